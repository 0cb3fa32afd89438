#!/usr/bin/env python3
"""An adaptive loop around a store: measure an error, ask for other lengths, make one sub-domain again.

  adaptive.py TETDB STORE [--subdomain N] [--rounds 3] [--tolerance T]

TETDB: the program. STORE: a finished store, changed in place. What stands for a solver here is a known function with a steep front: its error in a tetrahedron is how
far the mean of its four corners is from its value in the middle. Where it is above the tolerance lengths get smaller, where it is far below larger, at most by
half a round. Each round tells tetrahedra, the greatest and the root mean square error, and checks that no other sub-domain and no interface has changed. Exit code
0 when the last error is below three quarters of the first.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

EDGES = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stderr}")
    return done.stdout


def front(points, low, high):
    """A step across a sphere in the middle of the box, four hundredths of its diagonal wide."""
    diagonal = np.linalg.norm(high - low)
    distance = np.linalg.norm(points - (low + high) / 2, axis=-1) - 0.25 * diagonal
    return np.tanh(distance / (0.04 * diagonal))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tetdb")
    parser.add_argument("store")
    parser.add_argument("--subdomain", type=int, default=0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--tolerance", type=float)
    args = parser.parse_args()

    def info():
        return json.loads(run(args.tetdb, "info", args.store, "--json"))

    first = info()
    others = {s["id"]: s["digest"] for s in first["subdomains"] if s["id"] != args.subdomain}
    bounds = np.array(next(s for s in first["subdomains"] if s["id"] == args.subdomain)["bounds"])
    tolerance, errors = args.tolerance, []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for done in range(args.rounds + 1):
            run(args.tetdb, "export", args.store, folder / "part.npy", "--subdomain", args.subdomain)
            points, tets = (np.load(folder / f"part_{name}.npy") for name in ("points", "tets"))
            corners = points[tets]
            values = front(corners, *bounds)
            error = np.abs(values.mean(1) - front(corners.mean(1), *bounds))
            errors.append(float(np.sqrt((error**2).mean())))
            print(f"round {done}: {len(tets)} tetrahedra, error {error.max():.4f} at most, {errors[-1]:.5f} root mean square")
            if done == args.rounds:
                break
            tolerance = tolerance or errors[0] / 3
            lengths = np.mean([np.linalg.norm(corners[:, i] - corners[:, j], axis=1) for i, j in EDGES], axis=0)
            # The error of linear pieces goes with the square of their length.
            factor = np.sqrt(tolerance / np.maximum(error, 1e-12)).clip(0.5, 1.5)
            np.save(folder / "h.npy", lengths * factor)
            run(args.tetdb, "resaturate", args.store, "--subdomain", args.subdomain, "--size-field", folder / "h.npy")
    last = info()
    same = {s["id"]: s["digest"] for s in last["subdomains"] if s["id"] != args.subdomain} == others
    if not same or last["interfaces"] != first["interfaces"]:
        sys.exit("another sub-domain or an interface has changed")
    if errors[-1] > errors[0] * 3 / 4:
        sys.exit(f"the error went from {errors[0]:.5f} to {errors[-1]:.5f} only")
    print("no other sub-domain and no interface has changed")


if __name__ == "__main__":
    main()
