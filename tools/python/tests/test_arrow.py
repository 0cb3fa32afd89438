"""Tables as Arrow streams: what readers get is what the store's own arrays, its exports and its questions say."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import tetdb


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tetdb.Store]:
    """Two sub-domains with fields of all kinds, and a version from before the fields."""
    path = tmp_path_factory.mktemp("arrow") / "s.tetdb"
    surface = tetdb.sample("balls,count=2,h=0.07")
    with tetdb.mesh(surface, path, regions="all", hsiz=0.048, subdomains=2) as store:
        store.save_version("bare")
        chance = np.random.default_rng(7)
        parts = [store.subdomain(rank) for rank in range(2)]
        store.fields.add("T", chance.random(store.n_tets).astype(np.float32), at="tets")
        store.fields.add("n", np.concatenate([p.ids for p in parts]), at="tets")
        ids, first = np.unique(np.concatenate([p.vertex_ids for p in parts]), return_index=True)
        store.fields.add("u", 2 * np.concatenate([p.points for p in parts])[first], at="vertices", ids=ids)
        yield store


def test_columns_are_those_of_the_arrays(store: tetdb.Store) -> None:
    pa = pytest.importorskip("pyarrow")
    stream = store.arrow()
    table = pa.table(stream)
    assert table.num_rows == store.n_tets and table.schema.names == list(stream.schema)
    assert [str(kind).replace("double", "float64").replace("float", "float32").replace("float3264", "float64") for kind in table.schema.types] == list(
        stream.schema.values()
    )
    assert pa.schema(stream) == table.schema
    mine = {name: table.column(name).to_numpy() for name in table.schema.names}
    parts = [store.subdomain(rank) for rank in range(2)]
    assert (mine["id"] == np.concatenate([p.ids for p in parts])).all() and (mine["n"] == mine["id"]).all()
    assert (mine["region"] == np.concatenate([p.regions for p in parts])).all()
    assert (mine["quality"] == np.concatenate([p.quality for p in parts])).all()
    assert (mine["subdomain"] == np.repeat([0, 1], [len(p.tets) for p in parts])).all()
    for i in range(4):
        assert (mine[f"v{i}"] == np.concatenate([p.vertex_ids[p.tets[:, i]] for p in parts])).all()
    assert (mine["T"] == np.concatenate([store.fields["T"].array(rank) for rank in range(2)])).all()
    points = pa.table(store.arrow("vertices", columns=["x", "u.x", "id"]))
    assert points.schema.names == ["x", "u.x", "id"]
    assert (points.column("u.x").to_numpy() == 2 * points.column("x").to_numpy()).all()
    assert (points.column("id").to_numpy() == np.concatenate([p.vertex_ids for p in parts])).all()
    faces = pa.table(store.arrow("faces")).to_pydict()
    facets = np.concatenate([p.facets for p in parts])
    assert (np.array(faces["triangle"]) == facets["triangle"]).all() and (np.array(faces["label"]) == facets["label"]).all()
    assert sum(tet is None for tet in faces["tet_front"]) == (facets["tets"][:, 0] < 0).sum()


def test_conditions_select_as_questions_do(store: tetdb.Store) -> None:
    pa = pytest.importorskip("pyarrow")
    for where in ("quality > 1.6", "x < 0.2 and region = 0", "T > 0.5 or n < 100", "u.x > 1.5", "quality > 1e9"):
        table = pa.table(store.arrow(where=where, columns=["id", "quality"]))
        asked = store.query(where)
        assert (table.column("id").to_numpy() == asked["id"]).all() and (table.column("quality").to_numpy() == asked["quality"]).all()
    assert pa.table(store.arrow(where="x < 0.5", columns=[])).num_rows == len(store.query("x < 0.5"))


def test_small_tables(store: tetdb.Store) -> None:
    pa = pytest.importorskip("pyarrow")
    rows = {name: pa.table(store.arrow(name)).to_pylist() for name in ("interfaces", "subdomains", "regions", "labels", "versions")}
    assert [row["tets"] for row in rows["subdomains"]] == [info.n_tets for info in store.subdomains]
    assert [(row["region"], row["filled"], row["tets"]) for row in rows["regions"]] == [(r.region, r.filled, r.tets) for r in store.regions]
    assert [row["name"] for row in rows["labels"]] == store.labels
    assert [row["name"] for row in rows["versions"]] == ["bare"]
    assert [(row["low"], row["high"], row["faces"]) for row in rows["interfaces"]] == [(0, 1, store.subdomains[0].interface_faces)]


def test_each_reader_begins_anew(store: tetdb.Store) -> None:
    pa = pytest.importorskip("pyarrow")
    stream = store.arrow(columns=["id"])
    assert pa.table(stream) == pa.table(stream)
    capsule = stream.__arrow_c_stream__()
    assert pa.RecordBatchReader._import_from_c_capsule(capsule).read_all().num_rows == store.n_tets
    with pytest.raises(pa.ArrowInvalid, match="released"):
        pa.RecordBatchReader._import_from_c_capsule(capsule)
    # One that nobody reads lets go of the store.
    store.arrow().__arrow_c_stream__()


def test_a_version(store: tetdb.Store) -> None:
    pa = pytest.importorskip("pyarrow")
    with tetdb.open(store.path, version="bare") as bare:
        assert "T" not in bare.arrow().schema and "T" in store.arrow().schema
        assert pa.table(bare.arrow()) == pa.table(store.arrow(columns=list(bare.arrow().schema)))


def test_wrong_questions(store: tetdb.Store) -> None:
    for call, code, word in (
        (lambda: store.arrow("tet"), "bad-query", "subdomains"),
        (lambda: store.arrow(columns=["id", "nix"]), "bad-query", "angle_min"),
        (lambda: store.arrow(where="quality >"), "bad-expression", "end"),
        (lambda: store.arrow(where="nix > 1"), "bad-expression", "nix"),
        (lambda: store.arrow("faces", where="x > 1"), "bad-query", "tetrahedra"),
    ):
        with pytest.raises(tetdb.TetdbError, match=word) as error:
            call()
        assert error.value.code == code


def test_damage_is_an_error_of_the_reader(store: tetdb.Store, tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    import shutil

    path = tmp_path / "copy.tetdb"
    shutil.copytree(store.path, path)
    with tetdb.open(str(path)) as copy:
        stream = copy.arrow(columns=["id"])
        for file in path.rglob("*"):
            if file.is_file() and file.stat().st_size == max(info.bytes for info in store.subdomains):
                data = bytearray(file.read_bytes())
                for at in range(len(data) // 4, len(data), 997):
                    data[at] ^= 0x55
                file.write_bytes(data)
        copy.close()
        with pytest.raises((tetdb.TetdbError, pa.ArrowException, OSError), match="damaged"):
            pa.table(stream)


def test_ctrl_c_ends_a_stream(store: tetdb.Store) -> None:
    pa = pytest.importorskip("pyarrow")
    reader = pa.RecordBatchReader.from_stream(store.arrow())
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        timer.start()
        try:
            while True:
                reader.read_all()
                reader = pa.RecordBatchReader.from_stream(store.arrow())
        except (pa.ArrowException, OSError) as error:
            assert "stopped" in str(error)
            time.sleep(10)
    timer.join()


def test_duckdb(store: tetdb.Store) -> None:
    duckdb = pytest.importorskip("duckdb")
    tets, subdomains = store.arrow(), store.arrow("subdomains")
    found = duckdb.sql("select subdomain, count(*), max(quality) from tets join subdomains using (subdomain) group by subdomain order by 1").fetchall()
    assert found == [(i.rank, i.n_tets, i.worst) for i in store.subdomains]
    assert tets is not None and subdomains is not None


def test_polars(store: tetdb.Store) -> None:
    polars = pytest.importorskip("polars")
    frame = polars.DataFrame(store.arrow(columns=["region", "volume"]))
    volumes = dict(frame.group_by("region").agg(polars.col("volume").sum()).iter_rows())
    assert volumes == pytest.approx({r.region: r.volume for r in store.regions if r.filled})


def test_the_parquet_export_has_the_same_columns(store: tetdb.Store, program: str, tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    done = subprocess.run([program, "export", store.path, str(tmp_path / "a.parquet")], capture_output=True, text=True, check=False)
    if done.returncode:
        assert "parquet" in done.stderr
        pytest.skip("the program is built without Parquet")
    for table, pattern in (("tets", "a_?????.parquet"), ("vertices", "a_?????_vertices.parquet")):
        written = pa.concat_tables([parquet.read_table(file) for file in sorted(tmp_path.glob(pattern))])
        streamed = pa.table(store.arrow(table, columns=written.schema.names))
        assert [field.type for field in streamed.schema] == [field.type for field in written.schema]
        assert streamed.to_pydict() == written.to_pydict()
