"""Tetrahedral meshes larger than memory: arrays in, arrays out, a store in between.

>>> import tetdb
>>> surface = tetdb.sample("box,h=0.5")
>>> points, tets = tetdb.tetrahedralize(surface, hsiz="20%")
>>> tets.shape[1]
4
"""

from ._errors import (
    InvalidMesh,
    NoRoom,
    OutOfMemory,
    StoreBusy,
    StoreDamaged,
    SurfaceError,
    TetdbError,
)
from ._fields import Fields, StoreField
from ._mesh import Comparison, compare, import_mesh, mesh, open, resume, tetrahedralize
from ._native import __version__
from ._options import Event
from ._sizes import Box, Cylinder, Field, Function, InRegion, NearLabel, Sphere
from ._store import Chunk, Merged, Quality, Region, Store, Subdomain, SubdomainInfo, Verification
from ._surface import CheckReport, Defects, Estimate, Surface, sample
from ._tasks import begin, gather, plan, run_task

__all__ = [
    "Box",
    "CheckReport",
    "Chunk",
    "Comparison",
    "Cylinder",
    "Defects",
    "Estimate",
    "Event",
    "Field",
    "Fields",
    "Function",
    "InRegion",
    "NearLabel",
    "InvalidMesh",
    "Merged",
    "NoRoom",
    "OutOfMemory",
    "Quality",
    "Region",
    "Sphere",
    "Store",
    "StoreBusy",
    "StoreDamaged",
    "StoreField",
    "Subdomain",
    "SubdomainInfo",
    "Surface",
    "SurfaceError",
    "TetdbError",
    "Verification",
    "__version__",
    "begin",
    "compare",
    "gather",
    "import_mesh",
    "mesh",
    "open",
    "plan",
    "resume",
    "run_task",
    "sample",
    "tetrahedralize",
]
