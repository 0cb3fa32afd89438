"""What PyVista finds by entry points: ``pyvista.read("part.tetdb")``, ``grid.save("part.tetdb")`` and ``surface.tetdb``."""

from __future__ import annotations

import os
import tempfile
from typing import Any

import pyvista

from ._mesh import import_mesh, mesh
from ._store import Store
from ._surface import CheckReport, Estimate, Surface

__all__ = ["Accessor", "read", "write"]


def read(path: str, subdomain: int | list[int] | None = None, **options: Any) -> Any:
    """The tetrahedra of a finished store, or of some of its sub-domains; options are those of :class:`Store`."""
    with Store(path, **options) as store:
        return store.to_pyvista(subdomain)


def write(dataset: Any, path: str, **options: Any) -> None:
    """Takes a grid of tetrahedra over into a new store; options are those of :func:`tetdb.import_mesh`.

    Cell data `region`, `subdomain` and, of triangles, `label` are kept; sub-domains unless `subdomains` gives another number.
    """
    if "subdomain" in dataset.cell_data and "subdomains" not in options:
        options.setdefault("part_field", "subdomain")
    with tempfile.TemporaryDirectory(prefix="tetdb-") as folder:
        file = os.path.join(folder, "mesh.vtu")
        dataset.cast_to_unstructured_grid().save(file)
        import_mesh(file, path, **options).close()


@pyvista.register_dataset_accessor("tetdb", pyvista.DataSet)
class Accessor:
    """``dataset.tetdb``: a surface, or the boundary of cells, to be checked and meshed."""

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset

    def surface(self) -> Surface:
        """What tetdb takes the dataset for."""
        return Surface(self._dataset)

    def check(self) -> CheckReport:
        """As :meth:`Surface.check`."""
        return self.surface().check()

    def estimate(self, **options: Any) -> Estimate:
        """As :meth:`Surface.estimate`."""
        return self.surface().estimate(**options)

    def mesh(self, path: str | os.PathLike[str], **options: Any) -> Store:
        """As :func:`tetdb.mesh`: a store, for meshes of any size."""
        return mesh(self.surface(), path, **options)

    def tetrahedralize(self, **options: Any) -> Any:
        """An ``UnstructuredGrid`` of tetrahedra, for meshes that fit into memory; options are those of :func:`tetdb.mesh`.

        Examples
        --------
        >>> import pyvista
        >>> ball = pyvista.Icosphere(nsub=2)
        >>> ball.tetdb.tetrahedralize(hsiz=0.2).n_cells > 100
        True
        """
        with tempfile.TemporaryDirectory(prefix="tetdb-") as folder:
            with self.mesh(os.path.join(folder, "mesh"), **options) as store:
                return store.to_pyvista()
