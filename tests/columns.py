#!/usr/bin/env python3
"""Do other programs find in the columns what `tetdb info` says?

  columns.py INFO.json FILE...

INFO.json: what `tetdb info --json` printed. FILE: exports of that store as .vtu (pyvista), .npy (numpy) or .parquet (DuckDB; the
name that was given to `tetdb export`). Each gives the number of tetrahedra, in all and in each sub-domain, their volume, the worst
quality and the share of q below 2. A program that is not installed is skipped and named. Exit code 0 when all agree, else 1.
"""

import json
import sys


def by_numpy(path):
    import numpy

    points, tets, quality, rank = (numpy.load(f"{path[:-4]}_{name}.npy", mmap_mode="r") for name in ("points", "tets", "quality", "subdomain"))
    a, b, c, d = (points[tets[:, i]] for i in range(4))
    volume = numpy.einsum("ij,ij->i", b - a, numpy.cross(c - a, d - a)).sum() / 6
    return len(tets), dict(zip(*(x.tolist() for x in numpy.unique(rank, return_counts=True)))), volume, quality.max(), (quality < 2).mean()


def by_pyvista(path):
    import numpy
    import pyvista

    mesh = pyvista.read(path)
    quality, rank = mesh.cell_data["quality"], mesh.cell_data["subdomain"]
    counts = dict(zip(*(x.tolist() for x in numpy.unique(rank, return_counts=True))))
    return mesh.n_cells, counts, mesh.volume, quality.max(), (quality < 2).mean()


def by_duckdb(path):
    import duckdb

    tets = f"read_parquet('{path[:-8]}_?????.parquet')"
    vertices = f"read_parquet('{path[:-8]}_?????_vertices.parquet')"
    n, volume, worst, near = duckdb.sql(f"select count(*), sum(volume), max(quality), avg((quality < 2)::int) from {tets}").fetchall()[0]
    counts = dict(duckdb.sql(f"select subdomain, count(*) from {tets} group by subdomain").fetchall())
    # Each vertex named is there, and where the centroid says.
    off = duckdb.sql(
        f"""with place as (select distinct id, x, y, z from {vertices})
        select count(*), max(abs(t.x - (a.x + b.x + c.x + d.x) / 4)) from {tets} t
        join place a on t.v0 = a.id join place b on t.v1 = b.id join place c on t.v2 = c.id join place d on t.v3 = d.id"""
    ).fetchall()[0]
    assert off[0] == n and off[1] < 1e-9, f"vertices and centroids do not fit: {off}"
    # Groups of rows are small boxes: what a question about a place may leave out.
    groups = duckdb.sql(
        f"""select max(stats_max_value::double - stats_min_value::double), count(*) from parquet_metadata('{path[:-8]}_?????.parquet')
        where path_in_schema = 'x'"""
    ).fetchall()[0]
    assert groups[0] is not None, "groups of rows have no least and greatest value"
    return n, counts, volume, worst, near


READERS = {".npy": ("numpy", by_numpy), ".vtu": ("pyvista", by_pyvista), ".parquet": ("duckdb", by_duckdb)}


def main(info, paths):
    info = json.load(open(info))
    parts = info["subdomains"]
    counts = {part["id"]: part["tets"] for part in parts}
    volume = sum(part["volume"] for part in parts)
    worst = max(part["worst_q"] for part in parts)
    near = sum(part["quality"]["bins"][0] for part in parts) / info["tets"]
    for path in paths:
        name, read = READERS[path[path.rindex(".") :]]
        try:
            found = read(path)
        except ModuleNotFoundError as missing:
            print(f"skipped: {path}: {missing}")
            continue
        n, per_part, v, w, share = found
        assert n == info["tets"], f"{path}: {n} tetrahedra instead of {info['tets']}"
        assert per_part == counts, f"{path}: {per_part} instead of {counts}"
        assert abs(v / volume - 1) < 1e-9, f"{path}: volume {v} instead of {volume}"
        assert abs(w / worst - 1) < 1e-12, f"{path}: worst quality {w} instead of {worst}"
        assert abs(share - near) < 1e-12, f"{path}: share {share} instead of {near}"
        print(f"{path}: {name} finds {n} tetrahedra, volume {v:.9g}, worst quality {w:.6f}, as tetdb says")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
