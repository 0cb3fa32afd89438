#!/usr/bin/env python3
"""Wall time of a mesh against workers, forecast from the journal of a store.

    tetdb info STORE --json | tools/schedule.py [--front SECONDS] [--workers 1,2,4,...] [--overhead SECONDS]

The journal has the seconds of the coarse mesh, of every cut and of every sub-domain. They are put on so many
workers as the program does it: a cut begins when the one above it is done, sub-domains begin when all cuts are,
whoever is free takes the next, and the last of the tree are the last to be taken. What is before the coarse mesh
(reading, validation, sizes) is in no journal: --front says how long that took. It and the coarse mesh are serial.

Seconds count as they were measured: a store meshed by several threads at once has those of tasks that shared
memory and caches. --overhead is added to every task, for a scheduler that starts a process for each.
"""

import argparse
import heapq
import json
import sys


def tree(n):
    """The cut above each cut of a mesh of n sub-domains, by number; None for the first."""
    above, parts = {}, [(0, n, None)]
    while parts:
        first, count, parent = parts.pop()
        if count > 1:
            cut = first + count // 2
            above[cut] = parent
            parts += [(first, count // 2, cut), (cut, count - count // 2, cut)]
    return above


def tasks_of(journal):
    """Seconds of the coarse mesh, of cuts by number, of sub-domains by rank."""
    coarse, cuts, leaves = 0.0, {}, {}
    for row in journal:
        measures = {m["name"]: m["value"] for m in row["measures"]}
        if row["step"] == "coarse mesh":
            coarse = row["seconds"]
        elif row["step"] == "bisect":
            cuts[int(measures["cut"])] = row["seconds"]
        elif row["step"].startswith("saturate"):
            leaves[row["subdomain"]] = row["seconds"]
    return coarse, cuts, leaves


def cuts_wall(cuts, above, workers):
    """List schedule of the tree: longest way to the bottom first."""
    below = {cut: [] for cut in cuts}
    for cut, parent in above.items():
        if parent is not None:
            below[parent].append(cut)
    way = {}
    for cut in sorted(cuts, key=lambda c: depth(above, c), reverse=True):
        way[cut] = cuts[cut] + max((way[c] for c in below[cut]), default=0.0)
    ready = [(-way[c], c) for c in cuts if above[c] is None]
    running, now = [], 0.0
    while ready or running:
        while ready and len(running) < workers:
            _, cut = heapq.heappop(ready)
            heapq.heappush(running, (now + cuts[cut], cut))
        now, cut = heapq.heappop(running)
        for c in below[cut]:
            heapq.heappush(ready, (-way[c], c))
    return now


def depth(above, cut):
    n = 0
    while above[cut] is not None:
        cut, n = above[cut], n + 1
    return n


def leaves_wall(leaves, workers):
    """Sub-domains in the order of their ranks, each to whoever is free first."""
    free = [0.0] * min(workers, max(1, len(leaves)))
    for rank in sorted(leaves):
        heapq.heapreplace(free, free[0] + leaves[rank])
    return max(free)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("info", nargs="?", help="what `tetdb info STORE --json` wrote [default: standard input]")
    parser.add_argument("--front", type=float, default=0.0, metavar="SECONDS")
    parser.add_argument("--overhead", type=float, default=0.0, metavar="SECONDS")
    parser.add_argument("--workers", default="1,2,4,8,16,32,64,128,256,512,1024,2048,4096")
    args = parser.parse_args()
    info = json.load(open(args.info) if args.info else sys.stdin)
    coarse, cuts, leaves = tasks_of(info["journal"])
    above = tree(len(leaves))
    if not leaves or set(above) != set(cuts):
        sys.exit("the journal has not every cut and every sub-domain: is the mesh finished, and its own?")
    cuts = {cut: s + args.overhead for cut, s in cuts.items()}
    leaves = {rank: s + args.overhead for rank, s in leaves.items()}
    serial = args.front + coarse
    one = serial + sum(cuts.values()) + sum(leaves.values())
    print(f"{len(leaves)} sub-domains; serial {serial:.1f} s, cuts {sum(cuts.values()):.1f} s, sub-domains {sum(leaves.values()):.1f} s")
    longest = cuts_wall(cuts, above, len(cuts) or 1)
    print(f"with any number of workers: serial {serial:.1f} + tree {longest:.1f} + longest sub-domain {max(leaves.values()):.1f} s")
    print(f"{'workers':>8} {'wall s':>9} {'cuts s':>9} {'sub-d. s':>9} {'faster':>7}")
    for workers in map(int, args.workers.split(",")):
        parts = cuts_wall(cuts, above, workers), leaves_wall(leaves, workers)
        wall = serial + sum(parts)
        bar = "#" * round(40 * wall / one)
        print(f"{workers:>8} {wall:>9.1f} {parts[0]:>9.1f} {parts[1]:>9.1f} {one / wall:>6.2f}x {bar}")


if __name__ == "__main__":
    main()
