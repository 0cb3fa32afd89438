"""Reads a store in ParaView without a window: `pvbatch check.py STORE`. Fails unless all is as `tetdb` says.

`pvbatch check.py STORE RANK` reads one sub-domain alone, and says what that takes in seconds and MiB.
"""

import inspect
import os
import resource
import sys
import time

import numpy as np
import tetdb
from paraview import servermanager
from paraview.simple import Delete, LoadPlugin, UpdatePipeline
from vtkmodules.util.numpy_support import vtk_to_numpy

# ParaView 5.11 asks for what Python 3.11 no longer has.
if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec

LoadPlugin(os.path.join(os.path.dirname(os.path.abspath(__file__)), "tetdb_reader.py"), remote=False, ns=globals())

path = sys.argv[1]
with tetdb.open(path) as store:
    parts = {str(part.rank): part.n_tets for part in store.subdomains}
if len(sys.argv) > 2:
    rank, before = sys.argv[2], resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.perf_counter()
    reader = TetdbStore(FileName=path)  # noqa: F821
    reader.UpdatePipelineInformation()
    reader.Subdomains = [rank]
    UpdatePipeline(proxy=reader)
    found, seconds = reader.GetDataInformation().GetNumberOfCells(), time.perf_counter() - start
    assert found == parts[rank], (rank, found)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"sub-domain {rank} of {len(parts)}, {found} of {sum(parts.values())} tetrahedra: {seconds:.2f} s, {peak / 1024:.0f} MiB at most, {before / 1024:.0f} before")
    sys.exit()
with tetdb.open(path) as store:
    quality = np.concatenate([store.subdomain(int(rank)).quality for rank in parts])

for file in (path, os.path.join(path, "catalog.redb")):
    reader = TetdbStore(FileName=file)  # noqa: F821
    reader.UpdatePipelineInformation()
    assert list(reader.Subdomains.Available) == list(parts), (reader.Subdomains.Available, parts)
    for chosen in [list(parts), list(parts)[1:], list(parts)[:1]]:
        reader.Subdomains = chosen
        UpdatePipeline(proxy=reader)
        found = reader.GetDataInformation().GetNumberOfCells()
        assert found == sum(parts[rank] for rank in chosen), (chosen, found)
        low, high = reader.CellData["subdomain"].GetRange()
        assert (low, high) == (int(chosen[0]), int(chosen[-1])), (low, high)
    reader.Subdomains = list(parts)
    UpdatePipeline(proxy=reader)
    assert np.allclose(reader.CellData["quality"].GetRange(), [quality.min(), quality.max()])
    grid = servermanager.Fetch(reader)
    points = vtk_to_numpy(grid.GetPoints().GetData())
    a, b, c, d = points[vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4)].swapaxes(0, 1)
    volumes = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0
    assert volumes.min() > 0.0 and abs(volumes.sum() - 1.0) < 1e-9, (volumes.min(), volumes.sum())
    Delete(reader)
print(f"ParaView reads {sum(parts.values())} tetrahedra in {len(parts)} sub-domains")
