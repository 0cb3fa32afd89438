#!/usr/bin/env python3
"""What a point costs two programs that have just started, in pairs: the same store, the same points, in turns.

  cold_pairs.py STORE OLD NEW [--points 300] [--runs 3] [--instructions 0]

Each question is a process of its own. Of each point and program the least of the runs counts, for others on the machine only make it longer. Prints the new time over the old: the median
of pairs, the sum, and the same of CPU time. With --instructions N, also the instructions of the first N points, counted by callgrind.
"""
import argparse
import json
import os
import pathlib
import random
import re
import statistics
import subprocess
import tempfile
import time


def bounds(program, store):
    info = json.loads(subprocess.check_output([program, "info", store, "--json"], stderr=subprocess.DEVNULL))
    low = [min(part["bounds"][0][axis] for part in info["subdomains"]) for axis in range(3)]
    high = [max(part["bounds"][1][axis] for part in info["subdomains"]) for axis in range(3)]
    return low, high


def words(program, store, point):
    return [program, "query", store, "--point=" + ",".join(map(repr, point)), "--json"]


def ask(program, store, point):
    """Seconds, and seconds of processors."""
    clock = time.perf_counter()
    child = subprocess.Popen(words(program, store, point), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{program}: exit {child.returncode}")
    return time.perf_counter() - clock, used.ru_utime + used.ru_stime


def instructions(program, store, point):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out"
        call = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}"] + words(program, store, point)
        subprocess.run(call, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
        return int(re.search(r"^(?:summary|totals): (\d+)", out.read_text(), re.M).group(1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store")
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--points", type=int, default=300)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--instructions", type=int, default=0)
    args = parser.parse_args()
    low, high = bounds(args.new, args.store)
    seed = random.Random(1)
    points = [[seed.uniform(a, b) for a, b in zip(low, high)] for _ in range(args.points)]
    pairs = []
    for i, point in enumerate(points):
        runs = {args.old: [], args.new: []}
        for run in range(args.runs):
            order = [args.old, args.new] if (i + run) % 2 else [args.new, args.old]
            for program in order:
                runs[program].append(ask(program, args.store, point))
        pairs.append([[min(column) for column in zip(*runs[program])] for program in (args.old, args.new)])
    for k, name in enumerate(["time", "CPU time"]):
        old, new = [p[0][k] for p in pairs], [p[1][k] for p in pairs]
        median = statistics.median(b / a for a, b in zip(old, new) if a > 0)
        print(f"{name}: new over old {median:.3f} in the median of pairs, {sum(new) / sum(old):.3f} in sum; "
              f"medians {1e3 * statistics.median(old):.2f} and {1e3 * statistics.median(new):.2f} ms")
    if args.instructions:
        counts = [[instructions(p, args.store, point) for p in (args.old, args.new)] for point in points[:args.instructions]]
        old, new = (statistics.median(c[k] for c in counts) for k in (0, 1))
        print(f"instructions: medians {old / 1e6:.2f} M and {new / 1e6:.2f} M, {statistics.median(b / a for a, b in counts):.3f} in the median of pairs")


main()
