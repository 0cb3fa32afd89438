"""What a single point costs a program that has just started: chunks read and milliseconds, over many random points.

    python3 tools/cold_points.py part.tetdb [points] [path of tetdb]

Each point is a process of its own. Points outside the mesh count too.
"""
import collections
import json
import random
import subprocess
import sys
import time


def bounds(program, store):
    """The box of the mesh."""
    info = json.loads(subprocess.check_output([program, "info", store, "--json"], stderr=subprocess.DEVNULL))
    low = [min(part["bounds"][0][axis] for part in info["subdomains"]) for axis in range(3)]
    high = [max(part["bounds"][1][axis] for part in info["subdomains"]) for axis in range(3)]
    return low, high


def ask(program, store, point):
    """Chunks read for the point, whether it is in the mesh, and seconds."""
    text = ",".join(repr(x) for x in point)
    clock = time.perf_counter()
    done = subprocess.run([program, "query", store, f"--point={text}", "--json"], capture_output=True, text=True, check=True)
    seconds = time.perf_counter() - clock
    chunks = json.loads(done.stderr.splitlines()[-1])["measures"]["chunks"]
    found = json.loads(done.stdout.splitlines()[0])["id"] is not None
    return chunks["tet_chunks_read"], chunks["vertex_chunks_read"], found, seconds


def main():
    store, rest = sys.argv[1], sys.argv[2:]
    n = int(rest[0]) if rest else 1000
    program = rest[1] if len(rest) > 1 else "tetdb"
    low, high = bounds(program, store)
    seed = random.Random(1)
    answers = []
    for _ in range(n):
        point = [seed.uniform(a, b) for a, b in zip(low, high)]
        answers.append((*ask(program, store, point), point))
    sums = sorted(tets + vertices for tets, vertices, *_ in answers)
    milliseconds = sorted(1e3 * seconds for *_, seconds, _ in answers)
    at = lambda values, share: values[min(len(values) - 1, int(share * len(values)))]
    print(f"{n} points, {sum(found for *_, found, _, _ in answers)} in the mesh")
    print("chunks: " + ", ".join(f"{count} x {chunks}" for chunks, count in sorted(collections.Counter(sums).items())))
    for name, values in [("chunks", sums), ("milliseconds", milliseconds)]:
        print(f"{name}: median {at(values, 0.5):.3g}, nine in ten at most {at(values, 0.9):.3g}, at most {values[-1]:.3g}")
    worst = max(answers, key=lambda a: a[0] + a[1])
    print(f"most: {worst[0]} of tetrahedra and {worst[1]} of vertices at {','.join(map(repr, worst[4]))}")


main()
