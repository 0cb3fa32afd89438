#!/usr/bin/env python3
"""Wall time of a mesh against threads or workers, forecast from the journal of a store.

    tetdb info STORE --json | tools/schedule.py [--front SECONDS] [--workers 1,2,4,...] [--overhead SECONDS] [--one]

The journal has the seconds of each step, and how many of them threads can share: those of one thread alone, those
of work without order, and those of tasks that wait for each other with their longest chain. A step with n threads
takes what one does alone, the n-th part of the rest, and the chain, which is an upper bound for any such tasks.
What one does beside the checks (the head start of a run with more than one thread) stays beside them.

Steps are put on so many workers as the program does it: a cut begins when the one above it is done, sub-domains
begin when all cuts are, whoever is free takes the next, and the last of the tree are the last to be taken. Workers
that are left over are threads of those at work. With --one each task has one thread, as tasks of a cluster do.
What is before the checks (reading) is in no journal: --front says how long that took.

Seconds count as they were measured. A run with one thread has no work shared in some places where two would share
it, so a run with two threads on an idle machine forecasts best. --overhead is added to every task, for a scheduler
that starts a process for each.
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


class Step:
    """Seconds of a step, as threads can share them."""

    def __init__(self, seconds, measures):
        self.serial, self.shared, tasks, self.chain = (measures.get(k, 0.0) for k in ("serial_s", "parallel_s", "tasks_s", "chain_s"))
        self.shared += tasks - self.chain
        if "serial_s" not in measures:
            self.serial = seconds

    def with_threads(self, n):
        return self.serial + self.chain + self.shared / max(1.0, n)


def tasks_of(journal):
    """The checks, the insertion beside them, the coarse mesh, cuts by number, sub-domains by rank."""
    checks, beside, coarse, cuts, leaves = Step(0.0, {}), 0.0, Step(0.0, {}), {}, {}
    for row in journal:
        measures = {m["name"]: m["value"] for m in row["measures"]}
        step = Step(row["seconds"], measures)
        if row["step"] == "check, sizes":
            checks = step
        elif row["step"] == "coarse mesh":
            coarse, beside = step, measures.get("head_start_s", 0.0)
        elif row["step"] == "bisect":
            cuts[int(measures["cut"])] = step
        elif row["step"].startswith("saturate"):
            leaves[row["subdomain"]] = step
    return checks, beside, coarse, cuts, leaves


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


def begin_wall(checks, beside, coarse, n):
    """Checks and the coarse mesh, with the insertion of vertices on a thread beside the checks if there are two."""
    begin = checks.with_threads(n) + beside if n < 2 else max(checks.with_threads(n - 1), beside)
    return begin + coarse.with_threads(n)


def wall(tasks, above, n, args):
    """Seconds of front, cuts and sub-domains with n workers."""
    *begin, cuts, leaves = tasks
    share = (lambda at_once: 1) if args.one else (lambda at_once: n / at_once)
    cut_seconds = {cut: step.with_threads(share(min(n, 2 ** depth(above, cut)))) + args.overhead for cut, step in cuts.items()}
    leaf_seconds = {rank: step.with_threads(share(min(n, len(leaves)))) + args.overhead for rank, step in leaves.items()}
    front = args.front + begin_wall(*begin, 1 if args.one else n)
    return front, cuts_wall(cut_seconds, above, n), leaves_wall(leaf_seconds, n)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("info", nargs="?", help="what `tetdb info STORE --json` wrote [default: standard input]")
    parser.add_argument("--front", type=float, default=0.0, metavar="SECONDS")
    parser.add_argument("--overhead", type=float, default=0.0, metavar="SECONDS")
    parser.add_argument("--one", action="store_true", help="one thread for each task")
    parser.add_argument("--workers", default="1,2,4,8,16,32,64,128,256,512,1024,2048,4096")
    args = parser.parse_args()
    info = json.load(open(args.info) if args.info else sys.stdin)
    tasks = tasks_of(info["journal"])
    checks, beside, coarse, cuts, leaves = tasks
    above = tree(len(leaves))
    if not leaves or set(above) != set(cuts):
        sys.exit("the journal has not every cut and every sub-domain: is the mesh finished, and its own?")
    one = sum(wall(tasks, above, 1, args))
    steps = [checks, coarse, *cuts.values(), *leaves.values()]
    print(f"{len(leaves)} sub-domains; {one:.1f} s on one thread, {args.front + sum(s.serial for s in steps):.1f} s of it for one alone, "
          f"longest chains {sum(s.chain for s in steps):.1f} s, beside the checks {beside:.1f} s")
    print(f"{'workers':>8} {'wall s':>9} {'front s':>9} {'cuts s':>9} {'sub-d. s':>9} {'faster':>7}")
    for workers in map(int, args.workers.split(",")):
        parts = wall(tasks, above, workers, args)
        bar = "#" * round(40 * sum(parts) / one)
        print(f"{workers:>8} {sum(parts):>9.1f} {parts[0]:>9.1f} {parts[1]:>9.1f} {parts[2]:>9.1f} {one / sum(parts):>6.2f}x {bar}")


if __name__ == "__main__":
    main()
