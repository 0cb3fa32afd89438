"""A mesh by workers of Dask: python with_dask.py FOLDER [SCHEDULER].

FOLDER is seen by all workers. Without the address of a scheduler two processes of this machine work. Exit code 0 when the mesh is that of
one process.
"""

# mypy: disable-error-code="no-untyped-call, import-untyped, import-not-found"
from __future__ import annotations

import os
import sys

from dask.distributed import Client, LocalCluster

import tetdb


def main(folder: str, scheduler: str | None = None) -> None:
    path = os.path.join(folder, "part.tetdb")
    surface, options = tetdb.sample("box,h=0.06"), {"hsiz": 0.04, "subdomains": 2}
    with Client(scheduler or LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)) as client:
        tetdb.begin(surface, path, **options)
        stage = tetdb.plan(path, 2)
        while stage:
            # Not pure: what counts is the file a task leaves, not the answer of a call before.
            client.gather([client.submit(tetdb.run_task, path, k, threads=1, pure=False) for k in stage])
            stage = tetdb.gather(path)
    with tetdb.resume(path) as store, tetdb.mesh(surface, path + ".alone", hsiz=0.04, subdomains=2) as alone:
        print(f"{store.n_tets} tetrahedra in {len(store.subdomains)} sub-domains, digest {store.digest}")
        sys.exit(store.digest != alone.digest)


if __name__ == "__main__":
    main(*sys.argv[1:])
