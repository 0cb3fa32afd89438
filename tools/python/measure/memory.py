"""Memory of reading a store from Python: `memory.py STORE [EXPORTED.vtu [meshio]]`."""

import sys
import time

import numpy as np  # noqa: F401

import tetdb

MIB = 1 << 20


def status(name):
    with open("/proc/self/status") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith(name)) * 1024 / MIB


def measured(name, work):
    with open("/proc/self/clear_refs", "w") as refs:
        refs.write("5")
    before, start, cpu = status("VmRSS"), time.perf_counter(), time.process_time()
    array_bytes = work()
    seconds, cpu, peak = time.perf_counter() - start, time.process_time() - cpu, status("VmHWM")
    print(f"{name}: {seconds:.2f} s, CPU {cpu:.2f} s, arrays {array_bytes / MIB:.0f} MiB, grew by {peak - before:.0f} MiB, peak {peak:.0f} MiB of the process", flush=True)


def subdomain(store, rank):
    part = store.subdomain(rank)
    names = ("points", "tets", "regions", "quality", "ids", "vertex_ids", "lengths", "interfaces", "facets")
    return sum(getattr(part, name).nbytes for name in names)


def chunks(store, with_quality):
    total = 0
    for chunk in store.chunks(1_000_000):
        total += chunk.points.nbytes + chunk.tets.nbytes + chunk.regions.nbytes + chunk.ids.nbytes + chunk.vertex_ids.nbytes
        total += chunk.quality.nbytes if with_quality else 0
        del chunk
    return total


def vtu(path):
    import pyvista

    mesh = pyvista.read(path)
    return mesh.points.nbytes + mesh.cell_connectivity.nbytes + sum(mesh.cell_data[name].nbytes for name in mesh.cell_data.keys())


def vtu_by_meshio(path):
    import meshio

    return meshio.read(path).points.nbytes


store = tetdb.open(sys.argv[1])
print(store)
measured("chunks of 1,000,000", lambda: chunks(store, False))
measured("chunks of 1,000,000 with qualities", lambda: chunks(store, True))
for rank in range(len(store.subdomains)):
    measured(f"sub-domain {rank} ({store.subdomains[rank].n_tets} tetrahedra)", lambda: subdomain(store, rank))
if len(sys.argv) > 2:
    measured("PyVista reads the .vtu", lambda: vtu(sys.argv[2]))
if len(sys.argv) > 3:
    measured("meshio reads the .vtu", lambda: vtu_by_meshio(sys.argv[2]))
