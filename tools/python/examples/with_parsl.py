"""A mesh by workers of Parsl: python with_parsl.py FOLDER.

FOLDER is seen by all workers; here these are two processes of this machine, on a cluster a provider of its own starts them. Exit code 0
when the mesh is that of one process.
"""

# mypy: disable-error-code="no-untyped-call, import-untyped, import-not-found"
from __future__ import annotations

import os
import sys

import parsl
from parsl.config import Config
from parsl.executors import HighThroughputExecutor
from parsl.providers import LocalProvider

import tetdb

HERE = HighThroughputExecutor(address="127.0.0.1", max_workers_per_node=2, cores_per_worker=0.5, provider=LocalProvider())


def main(folder: str) -> None:
    path = os.path.join(folder, "part.tetdb")
    surface, options = tetdb.sample("box,h=0.06"), {"hsiz": 0.04, "subdomains": 2}
    with parsl.load(Config(executors=[HERE], run_dir=os.path.join(folder, "runs"))):
        task = parsl.python_app(tetdb.run_task)
        tetdb.begin(surface, path, **options)
        stage = tetdb.plan(path, 2)
        while stage:
            for future in [task(path, k, threads=1) for k in stage]:
                future.result()
            stage = tetdb.gather(path)
    with tetdb.resume(path) as store, tetdb.mesh(surface, path + ".alone", hsiz=0.04, subdomains=2) as alone:
        print(f"{store.n_tets} tetrahedra in {len(store.subdomains)} sub-domains, digest {store.digest}")
        sys.exit(store.digest != alone.digest)


if __name__ == "__main__":
    main(*sys.argv[1:])
