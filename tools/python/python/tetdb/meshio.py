"""Stores as a format of meshio: ``import tetdb.meshio``, then ``meshio.read("part.tetdb")``."""

from __future__ import annotations

from typing import Any

import meshio  # type: ignore[import-untyped]

from ._store import Store

__all__ = ["read"]


def read(path: Any) -> Any:
    """The tetrahedra of a finished store as a ``meshio.Mesh``, with cell data `region` and `subdomain`."""
    with Store(path) as store:
        merged = store.merged()
    data = {"region": [merged.regions], "subdomain": [merged.subdomains]}
    return meshio.Mesh(merged.points, [("tetra", merged.tets)], cell_data=data)


meshio.register_format("tetdb", [".tetdb"], read, {})
