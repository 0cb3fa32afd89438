#!/usr/bin/env python3
"""Two builds of tetdb on the same surfaces: how many tetrahedra, how many of them bad.

  sizes.py OLD NEW SURFACE... [--mesh "--regions all"] [--seconds-max 600]

OLD, NEW: the programs. For each surface a row: tetrahedra, share of q < 2, number of q >= 10, worst q and seconds of both, in one thread without verification. A build that does not
end in time, or refuses the surface, has a word instead. Exit code 1 when the number of q >= 10 is higher in NEW somewhere.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time


def measured(program, surface, args):
    with tempfile.TemporaryDirectory() as folder:
        store = pathlib.Path(folder) / "a.tetdb"
        words = [program, "mesh", *surface.split(), *args.mesh.split(), "-o", store, "--threads", "1", "--no-verify", "--quiet"]
        start = time.monotonic()
        try:
            done = subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=args.seconds_max)
        except subprocess.TimeoutExpired:
            return f"> {args.seconds_max} s"
        seconds = time.monotonic() - start
        if done.returncode:
            return f"exit {done.returncode}"
        info = json.loads(subprocess.run([program, "info", str(store), "--json"], capture_output=True, text=True, check=True).stdout)
    parts = info["subdomains"]
    bins = [sum(part["quality"]["bins"][k] for part in parts) for k in range(len(parts[0]["quality"]["bins"]))]
    return sum(bins), 100 * bins[0] / sum(bins), bins[-1], max(part["quality"]["worst"] for part in parts), seconds


def text(result):
    if isinstance(result, str):
        return result
    n, good, bad, worst, seconds = result
    return f"{n:,}, {good:.1f} %, {bad:,}, {worst:.3g}, {seconds:.1f} s"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("surfaces", nargs="+")
    parser.add_argument("--mesh", default="--regions all")
    parser.add_argument("--seconds-max", type=float, default=600)
    args = parser.parse_args()
    print("| surface | before: count, q < 2, number of q >= 10, worst, time | after | count | q >= 10 |\n|---|---|---|---|---|")
    ratios = []
    for surface in args.surfaces:
        old, new = (measured(program, surface, args) for program in (args.old, args.new))
        name = pathlib.Path(surface.split()[0]).name
        ratio = ["", ""]
        if not isinstance(old, str) and not isinstance(new, str):
            ratio = [f"{new[0] / old[0]:.3f}", f"{new[2] / old[2]:.3f}" if old[2] else ("-" if not new[2] else "more")]
            if old[2]:
                ratios.append(new[2] / old[2])
        print(f"| {name} | {text(old)} | {text(new)} | {ratio[0]} | {ratio[1]} |", flush=True)
    if ratios:
        print(f"\nNumber of q >= 10: {statistics.median(ratios):.3f} times in the median of {len(ratios)}, {max(ratios):.3f} at most.")
    return int(any(ratio > 1 for ratio in ratios))


if __name__ == "__main__":
    sys.exit(main())
