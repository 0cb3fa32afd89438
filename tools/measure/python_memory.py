#!/usr/bin/env python3
"""Memory and seconds of reading a store from Python: chunk by chunk, sub-domain by sub-domain, and the exported file by other packages.

  python_memory.py STORE [--vtu EXPORTED.vtu] [--meshio]

  tetdb mesh sample:balls,count=20 -o a.tetdb --subdomains 2 --export a.vtu
  python_memory.py a.tetdb --vtu a.vtu

Needs tetdb's Python package and numpy; pyvista and meshio for the exported file.
"""
import argparse
import time

MIB = 1 << 20


def status(name):
    with open("/proc/self/status") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith(name)) * 1024 / MIB


def measured(name, work):
    """Runs `work`, which returns the bytes of its arrays, and prints what it took. Resets the process's peak first."""
    with open("/proc/self/clear_refs", "w") as refs:
        refs.write("5")
    before, start, cpu = status("VmRSS"), time.perf_counter(), time.process_time()
    array_bytes = work()
    seconds, cpu, peak = time.perf_counter() - start, time.process_time() - cpu, status("VmHWM")
    print(f"{name}: {seconds:.2f} s, CPU {cpu:.2f} s, arrays {array_bytes / MIB:.0f} MiB, process grew by {peak - before:.0f} MiB, "
          f"peak {peak:.0f} MiB", flush=True)


def subdomain(store, rank):
    part = store.subdomain(rank)
    names = ("points", "tets", "regions", "quality", "ids", "vertex_ids", "lengths", "interfaces", "facets")
    return sum(getattr(part, name).nbytes for name in names)


def chunks(store, with_quality):
    total = 0
    for chunk in store.chunks(1_000_000):
        total += chunk.points.nbytes + chunk.tets.nbytes + chunk.regions.nbytes + chunk.ids.nbytes + chunk.vertex_ids.nbytes
        total += chunk.quality.nbytes if with_quality else 0
        # Without this two chunks are held at once.
        del chunk
    return total


def vtu(path):
    import pyvista
    mesh = pyvista.read(path)
    return mesh.points.nbytes + mesh.cell_connectivity.nbytes + sum(mesh.cell_data[name].nbytes for name in mesh.cell_data.keys())


def vtu_by_meshio(path):
    import meshio
    return meshio.read(path).points.nbytes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store")
    parser.add_argument("--vtu", metavar="FILE", help="the exported mesh, read by PyVista")
    parser.add_argument("--meshio", action="store_true", help="read it by meshio too")
    args = parser.parse_args()
    import tetdb
    store = tetdb.open(args.store)
    print(store)
    measured("chunks of 1,000,000", lambda: chunks(store, False))
    measured("chunks of 1,000,000 with qualities", lambda: chunks(store, True))
    for rank, part in enumerate(store.subdomains):
        measured(f"sub-domain {rank} ({part.n_tets} tetrahedra)", lambda: subdomain(store, rank))
    if args.vtu:
        measured("PyVista reads the .vtu", lambda: vtu(args.vtu))
    if args.vtu and args.meshio:
        measured("meshio reads the .vtu", lambda: vtu_by_meshio(args.vtu))


if __name__ == "__main__":
    main()
