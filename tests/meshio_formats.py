#!/usr/bin/env python3
"""Does meshio write what it reads of our files in every format it can write tetrahedra in?

  meshio_formats.py FILE...

FILE: exports of first order (.vtu .msh .mesh .inp .ele). Where meshio reads its own file back, it must hold as many tetrahedra. Formats in WITHOUT
are listed with the reason, and so is what a format cannot take of a mesh that is not .vtu. Exit code 0 when all agree, else 1.
"""
import contextlib
import io
import os
import sys
import tempfile
import warnings

try:
    import meshio
    from meshio._helpers import _writer_map
except ImportError:
    sys.exit("skipped: meshio is not installed")

warnings.simplefilter("ignore")

WITHOUT = {
    "obj": "triangles and quadrilaterals alone", "off": "triangles alone", "ply": "surface cells alone", "stl": "triangles alone",
    "svg": "flat meshes alone", "wkt": "triangles alone", "h5m": "its writer fails on every mesh (meshio 5.3)",
}
# What meshio makes of .msh and .mesh has triangles beside tetrahedra, which these formats or their writers do not take.
MIXED = {"flac3d", "su2", "ugrid", "medit", "gmsh"}


def tets_of(mesh):
    return sum(len(block.data) for block in mesh.cells if block.type == "tetra")


def quiet(call, *words, **named):
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return call(*words, **named)


def main():
    wrong, refused = 0, {}
    for path in sys.argv[1:]:
        mesh = quiet(meshio.read, path)
        n, written, is_mixed = tets_of(mesh), 0, not path.endswith(".vtu")
        assert n, f"{path}: no tetrahedra"
        with tempfile.TemporaryDirectory() as folder:
            for ending, kinds in sorted(meshio.extension_to_filetypes.items()):
                for kind in kinds:
                    if kind in WITHOUT or kind not in _writer_map:
                        continue
                    out = os.path.join(folder, f"{kind}{ending}")
                    try:
                        quiet(meshio.write, out, mesh, file_format=kind)
                    except ModuleNotFoundError as error:
                        refused[kind] = f"{error.name} is not installed"
                        continue
                    except (Exception, SystemExit) as error:
                        if is_mixed and kind in MIXED:
                            refused[f"{kind} of {os.path.splitext(path)[1]}"] = f"{type(error).__name__} in meshio"
                        else:
                            print(f"{path}: meshio cannot write it as {kind}: {error!r}")
                            wrong += 1
                        continue
                    written += 1
                    try:
                        back = tets_of(quiet(meshio.read, out, file_format=kind))
                    except (Exception, SystemExit):  # it does not read what it wrote
                        continue
                    if back != n and not is_mixed:
                        print(f"{path}: {back} tetrahedra of {n} are left in {kind}")
                        wrong += 1
        print(f"{path}: meshio writes {n} tetrahedra in {written} ways")
    for kind, reason in {**WITHOUT, **refused}.items():
        print(f"not written: {kind}: {reason}")
    sys.exit(1 if wrong else 0)


main()
