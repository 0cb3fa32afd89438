"""Stores as a format of meshio: ``import tetdb.meshio``, then ``meshio.read("part.tetdb")`` and ``mesh.write("part.tetdb")``."""

from __future__ import annotations

import os
import tempfile
from typing import Any

import meshio  # type: ignore[import-untyped]

from ._mesh import import_mesh
from ._store import Store

__all__ = ["read", "write"]


def read(path: Any) -> Any:
    """The tetrahedra of a finished store as a ``meshio.Mesh``, with cell data `region` and `subdomain`."""
    with Store(path) as store:
        merged = store.merged()
    data = {"region": [merged.regions], "subdomain": [merged.subdomains]}
    return meshio.Mesh(merged.points, [("tetra", merged.tets)], cell_data=data)


def write(path: Any, mesh: Any, **options: Any) -> None:
    """Takes a mesh of tetrahedra over into a new store; options are those of :func:`tetdb.import_mesh`.

    Cell data `region`, `subdomain` and, of triangles, `label` are kept; sub-domains unless `subdomains` gives another number.
    """
    if "subdomain" in mesh.cell_data and "subdomains" not in options:
        options.setdefault("part_field", "subdomain")
    with tempfile.TemporaryDirectory(prefix="tetdb-") as folder:
        file = os.path.join(folder, "mesh.vtu")
        mesh.write(file, file_format="vtu")
        import_mesh(file, path, **options).close()


meshio.register_format("tetdb", [".tetdb"], read, {"tetdb": write})
