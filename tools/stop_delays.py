"""How long a run goes on after it was asked to stop, in each of its phases.

    python3 tools/stop_delays.py [SURFACE] [path of tetdb] [interrupts a phase] [further words for `mesh`...]

A run is started for each measurement and interrupted (SIGINT) at a random time of an undisturbed run's; what it was last at is told by its
progress. All runs must exit with 130; the last store is resumed.
"""
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


def phases(program, surface, store, words):
    """Seconds of an undisturbed run, import first, then steps in the order they ended; and what comes after the last one."""
    clock = time.perf_counter()
    answer = subprocess.check_output([program, "mesh", surface, "-o", store, "--json", *words], stderr=subprocess.DEVNULL)
    total = time.perf_counter() - clock
    steps = [(row["step"], row["seconds"]) for row in json.loads(answer)["journal"]]
    return total, steps


def interrupted(program, surface, store, words, after):
    """Seconds between the signal and the end, exit code, and where the run was: its last finished step."""
    child = subprocess.Popen(
        [program, "mesh", surface, "-o", store, "--json", *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    time.sleep(after)
    if child.poll() is not None:
        return None
    clock = time.perf_counter()
    child.send_signal(signal.SIGINT)
    child.wait()
    return time.perf_counter() - clock, child.returncode


def steps_of(program, store):
    done = subprocess.run([program, "info", store, "--json"], capture_output=True, text=True)
    if done.returncode != 0:
        return "before the store"
    info = json.loads(done.stdout)
    steps = [row["step"] for row in info["journal"]]
    return f"after {len(steps)} steps, the last {steps[-1]}" if steps else "coarse mesh"


def main():
    words = sys.argv[1:]
    surface = words[0] if words else "sample:balls,count=700"
    program = words[1] if len(words) > 1 else "tetdb"
    n = int(words[2]) if len(words) > 2 else 40
    more = words[3:] or ["--subdomains", "3"]
    folder = Path(tempfile.mkdtemp())
    store = folder / "a.tetdb"
    try:
        total, steps = phases(program, surface, store, more)
        print(f"{surface}: {total:.1f} s; " + ", ".join(f"{step} {seconds:.1f} s" for step, seconds in steps))
        shutil.rmtree(store)
        seed = random.Random(1)
        delays = collections.defaultdict(list)
        for i in range(n):
            # Evenly over the run, each a little off.
            after = total * (i + seed.random()) / n
            shutil.rmtree(store, ignore_errors=True)
            found = interrupted(program, surface, store, more, after)
            if found is None:
                continue
            seconds, exit_code = found
            assert exit_code in (130, 0), f"exit {exit_code} after {after:.1f} s"
            where = steps_of(program, store)
            delays[where].append(seconds)
            print(f"  {after:6.1f} s: {1e3 * seconds:7.0f} ms, exit {exit_code}, {where}", flush=True)
        for where, seconds in delays.items():
            print(f"{where}: {len(seconds)} interrupts, at most {1e3 * max(seconds):.0f} ms")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


main()
