#!/usr/bin/env python3
"""How long tetdb takes to answer one point, and to end after a signal.

  delays.py points STORE [--points 1000]                        chunks read and milliseconds for a point, each by a process of its own
  delays.py stops  [SURFACE] [--stops 40] [--mesh "--threads 2"]  seconds between SIGINT and the end, in each phase of a run

  delays.py points balls.tetdb --points 100 --tetdb target/release/tetdb
  delays.py stops sample:balls,count=50 --stops 10

Points are drawn evenly in the box of the mesh; those outside the mesh count too. Stops are spread evenly over the time of an undisturbed run.
Every stopped run must exit with 130, and the store it leaves must be readable.
"""
import argparse
import collections
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def info(program, store):
    done = subprocess.run([program, "info", store, "--json"], capture_output=True, text=True)
    return json.loads(done.stdout) if done.returncode == 0 else None


def ask(program, store, point):
    """Chunks read for the point, seconds, and whether the point is in the mesh."""
    text = ",".join(map(repr, point))
    clock = time.perf_counter()
    done = subprocess.run([program, "query", store, f"--point={text}", "--json"], capture_output=True, text=True, check=True)
    seconds = time.perf_counter() - clock
    chunks = json.loads(done.stderr.splitlines()[-1])["measures"]["chunks"]
    return chunks["tet_chunks_read"] + chunks["vertex_chunks_read"], seconds, json.loads(done.stdout.splitlines()[0])["id"] is not None


def points(args):
    low, high = info(args.tetdb, args.store)["bounds"]
    draw = random.Random(1)
    answers = [ask(args.tetdb, args.store, [draw.uniform(a, b) for a, b in zip(low, high)]) for _ in range(args.points)]
    print(f"{len(answers)} points, {sum(found for *_, found in answers)} in the mesh")
    for name, values in (("chunks", sorted(a[0] for a in answers)), ("milliseconds", sorted(1e3 * a[1] for a in answers))):
        n = len(values)
        print(f"{name}: median {values[n // 2]:.3g}, nine in ten at most {values[min(n - 1, n * 9 // 10)]:.3g}, at most {values[-1]:.3g}")


def stopped(command, after):
    """Exit code, and seconds between the signal and the end; None if the run ended before the signal."""
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(after)
    if child.poll() is not None:
        return None
    clock = time.perf_counter()
    child.send_signal(signal.SIGINT)
    return child.wait(), time.perf_counter() - clock


def phase(program, store):
    found = info(program, store) if Path(store).exists() else None
    if found is None:
        return "before the store"
    steps = [row["step"] for row in found["journal"]]
    return f"after {len(steps)} steps, the last {steps[-1]}" if steps else "coarse mesh"


def stops(args):
    folder = Path(tempfile.mkdtemp())
    store = str(folder / "a.tetdb")
    command = [args.tetdb, "mesh", args.surface, "-o", store, *args.mesh.split()]
    try:
        clock = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        total = time.perf_counter() - clock
        print(f"{args.surface}: {total:.1f} s")
        draw, delays = random.Random(1), collections.defaultdict(list)
        for i in range(args.stops):
            shutil.rmtree(store, ignore_errors=True)
            found = stopped(command, total * (i + draw.random()) / args.stops)
            if found is None:
                continue
            code, seconds = found
            if code not in (0, 130):
                sys.exit(f"exit {code} after a signal")
            delays[phase(args.tetdb, store)].append(seconds)
        for where, seconds in delays.items():
            print(f"{where}: {len(seconds)} stops, at most {1e3 * max(seconds):.0f} ms")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    sub = commands.add_parser("points", description="Chunks read and milliseconds for one point, each asked by a process of its own.")
    sub.set_defaults(run=points)
    sub.add_argument("store")
    sub.add_argument("--points", type=int, default=1000)
    sub.add_argument("--tetdb", default="tetdb")
    sub = commands.add_parser("stops", description="Seconds between SIGINT and the end of a run, in each of its phases.")
    sub.set_defaults(run=stops)
    sub.add_argument("surface", nargs="?", default="sample:balls,count=700")
    sub.add_argument("--stops", type=int, default=40)
    sub.add_argument("--mesh", default="--subdomains 3", help="words for `tetdb mesh`")
    sub.add_argument("--tetdb", default="tetdb")
    args = parser.parse_args()
    args.run(args)


if __name__ == "__main__":
    main()
