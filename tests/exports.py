#!/usr/bin/env python3
"""Do other programs read the exports as the store has them?

  exports.py INFO.json FILE...

INFO.json: what `tetdb info --json` printed. FILE: exports of that store (.vtu .mesh .meshb .msh .inp .npy).
Each file is opened by every program that reads its format (pyvista, meshio, gmsh; pip names); counts of
tetrahedra, vertices and boundary triangles, volume, labels and regions are compared. A program that is
not installed is skipped and named. Exit code 0 when all agree, else 1.
"""
import json
import os
import sys
import xml.etree.ElementTree  # noqa: F401  (pyvista and meshio load it late)

try:
    import numpy as np
except ImportError:
    sys.exit("skipped: numpy is not installed")

READERS = {".vtu": ("pyvista", "meshio"), ".mesh": ("meshio", "gmsh"), ".meshb": ("meshio",),
           ".msh": ("gmsh", "meshio"), ".inp": ("meshio",), ".npy": ("numpy",)}


def volume(points, tets):
    a, b, c, d = (points[tets[:, i]] for i in range(4))
    v = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6
    assert v.min() > 0, "a tetrahedron is inverted"
    return float(v.sum())


def seen(points, tets, tris, regions=None, labels=None):
    used = np.unique(np.concatenate([tets.ravel(), tris.ravel()]) if tris is not None else tets)
    assert len(used) == len(points), "vertices without tetrahedron"
    result = {"vertices": len(points), "tets": len(tets), "volume": volume(points, tets)}
    if tris is not None:
        result["triangles"] = len(tris)
    if regions is not None:
        result["regions"] = sorted(int(r) for r in np.unique(regions))
    if labels is not None:
        result["labels"] = labels
    return result


def by_pyvista(path):
    import pyvista
    mesh, skin = pyvista.read(path), pyvista.read(path[:-4] + "_boundary.vtu")
    names = bytes(skin.field_data["label_names"]).decode().split("\0")
    assert {"subdomain", "region", "quality", "excess", "global_id"} <= set(mesh.cell_data.keys())
    excess, quality = mesh.cell_data["excess"], mesh.cell_data["quality"]
    assert (1 <= excess).all() and (excess <= quality * (1 + 1e-12)).all() and (excess < quality).any()
    assert {"label", "input_id", "region_front", "region_back"} <= set(skin.cell_data.keys())
    assert np.array_equal(mesh.points[skin.point_data["mesh_vertex"]], skin.points)
    assert (np.diff(skin.cell_data["input_id"]) > 0).all()
    tets, tris = mesh.cells_dict[10].astype(np.int64), skin.cells_dict[5]
    tris = skin.point_data["mesh_vertex"][tris]
    return seen(np.asarray(mesh.points), tets, tris, mesh.cell_data["region"],
                {names[i] for i in np.unique(skin.cell_data["label"])})


def by_numpy(path):
    load = lambda name: np.load(f"{path[:-4]}_{name}.npy", mmap_mode="r")
    ids, quality = load("global_id"), load("quality")
    assert len(ids) == len(quality) == len(load("subdomain")) and (np.diff(ids) > 0).all()
    assert len(load("vertex_id")) == len(load("points")) and len(load("label")) == len(load("triangles"))
    return seen(load("points"), load("tets"), load("triangles"), load("region"))


def by_meshio(path):
    import meshio
    m = meshio.read(path)
    cells = {}
    for block in m.cells:
        cells.setdefault(block.type, []).append(block.data)
    tets = np.concatenate(cells["tetra"])
    tris = np.concatenate(cells["triangle"]) if "triangle" in cells else None
    key = next((k for k in ("region", "gmsh:physical", "medit:ref") if k in m.cell_data), None)
    regions = key and np.concatenate([d for b, d in zip(m.cells, m.cell_data[key]) if b.type == "tetra"])
    labels = {n for n, (_, dim) in m.field_data.items() if dim == 2} if path.endswith(".msh") else None
    if path.endswith(".vtu"):
        skin = meshio.read(path[:-4] + "_boundary.vtu")
        tris = skin.point_data["mesh_vertex"][skin.cells_dict["triangle"]]
    return seen(m.points, tets, tris, regions, labels)


def by_gmsh(path):
    import gmsh
    gmsh.initialize(["gmsh", "-v", "1"])
    try:
        gmsh.open(path)
        tags, xyz, _ = gmsh.model.mesh.getNodes()
        place = np.zeros(int(tags.max()) + 1, np.int64)
        place[tags] = np.arange(len(tags))
        tets = place[gmsh.model.mesh.getElementsByType(4)[1]].reshape(-1, 4)
        groups = gmsh.model.getPhysicalGroups()
        # Between partitions gmsh adds triangles of its own, which belong to no group of the input.
        skins = [e for dim, tag in groups if dim == 2 for e in gmsh.model.getEntitiesForPhysicalGroup(2, tag)] or [-1]
        tris = np.concatenate([gmsh.model.mesh.getElementsByType(2, skin)[1] for skin in skins])
        tris = place[tris].reshape(-1, 3)
        regions = [tag for dim, tag in groups if dim == 3] or None
        labels = {gmsh.model.getPhysicalName(2, tag) for dim, tag in groups if dim == 2}
        return seen(xyz.reshape(-1, 3), tets, tris, regions, labels if path.endswith(".msh") else None)
    finally:
        gmsh.finalize()


def expected(info):
    """What the store says; vertices are counted once per sub-domain there, so only a single one tells."""
    parts, filled = info["subdomains"], [r for r in info["regions"] if r["filled"]]
    want = {"tets": info["tets"], "volume": sum(p["volume"] for p in parts),
            "regions": sorted(r["region"] for r in filled),
            "labels": {info["labels"][i] for r in filled for i in r["labels"]}}
    if len(parts) == 1:
        want.update(vertices=parts[0]["vertices"], triangles=parts[0]["facets"])
    return want


def main():
    info, *files = sys.argv[1:]
    want = expected(json.load(open(info)))
    first, wrong = {}, 0
    for path in files:
        for program in READERS[os.path.splitext(path)[1]]:
            if program == "meshio" and path.endswith(".msh") and b"$PartitionedEntities" in open(path, "rb").read(1 << 20):
                print(f"{path}: skipped, meshio reads no partitioned entities")
                continue
            try:
                got = globals()["by_" + program](path)
            except ImportError:
                print(f"{path}: skipped, {program} is not installed")
                continue
            except Exception as error:  # whatever a reader says against the file is a finding
                print(f"{path}: {program} fails: {error!r}")
                wrong += 1
                continue
            for key, value in got.items():
                known = want.get(key, first.setdefault(key, value))
                same = abs(known - value) <= 1e-9 * abs(known) if key == "volume" else known == value
                if not same:
                    print(f"{path}: {program} sees {key} = {value}, expected {known}")
                    wrong += 1
            print(f"{path}: {program} sees {got['vertices']} vertices, {got['tets']} tetrahedra, "
                  f"{got.get('triangles', 'no')} triangles")
    sys.exit(1 if wrong else 0)


main()
