#!/usr/bin/env python3
"""The digest of an exported .meshb, computed from its bytes alone, beside what the store says of itself.

  meshb_digest.py STORE FILE.meshb [--tetdb PROGRAM]

The file tells coordinates, tetrahedra and regions; `tetdb info` only how many tetrahedra each sub-domain has, for they stand one
sub-domain after the other. Vertices between sub-domains are counted once in the file, in the store once in each. Exit code 1 when
the tetrahedra or the digest differ. Needs numpy; memory: 8 bytes a vertex and some blocks.
"""
import argparse
import json
import subprocess
import sys

import numpy as np

VERTEX_SEED, TET_SEEDS = 0x76657274, (0x7465742D6C6F0000, 0x7465742D68690000)
BLOCK = 1 << 20
VERTICES, TETRAHEDRA, END = 4, 8, 54


def mix(state, value):
    """The finalizer of splitmix64 of the state joined with a value; arrays of 64-bit numbers, which wrap around."""
    z = (state ^ value) + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ z >> np.uint64(30)) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ z >> np.uint64(27)) * np.uint64(0x94D049BB133111EB)
    return z ^ z >> np.uint64(31)


def records(path):
    """Keyword and records of each list of a version 4 file, as 64-bit numbers."""
    head = np.fromfile(path, "<i4", 2)
    if head[0] != 1 or head[1] != 4:
        sys.exit(f"{path}: not a little-endian .meshb of version 4")
    at = 8
    while True:
        keyword = int(np.fromfile(path, "<i4", 1, offset=at)[0])
        if keyword == END:
            return
        after = int(np.fromfile(path, "<i8", 1, offset=at + 4)[0])
        if keyword in (VERTICES, TETRAHEDRA):
            n = int(np.fromfile(path, "<i8", 1, offset=at + 12)[0])
            width = 4 if keyword == VERTICES else 5
            if at + 20 + 8 * width * n != after:
                sys.exit(f"{path}: a list of {n} records does not end where the next begins")
            yield keyword, np.memmap(path, "<u8", "r", at + 20, (n, width))
        at = after


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store")
    parser.add_argument("file")
    parser.add_argument("--tetdb", default="tetdb")
    args = parser.parse_args()
    info = json.loads(subprocess.run([args.tetdb, "info", args.store, "--json"], check=True, stdout=subprocess.PIPE).stdout)
    subdomains = sorted(info["subdomains"], key=lambda s: s["id"])
    ends = np.cumsum([s["tets"] for s in subdomains])
    ranks = np.array([s["id"] for s in subdomains], np.uint64)
    lanes, counts = [np.uint64(0), np.uint64(0)], {}
    np.seterr(over="ignore")
    for keyword, rows in records(args.file):
        counts[keyword] = len(rows)
        if keyword == VERTICES:
            mixes = np.empty(len(rows), np.uint64)
            for s in range(0, len(rows), BLOCK):
                state = np.uint64(VERTEX_SEED)
                for axis in range(3):
                    state = mix(state, np.asarray(rows[s:s + BLOCK, axis]))
                mixes[s:s + BLOCK] = state
            continue
        for s in range(0, len(rows), BLOCK):
            block = np.asarray(rows[s:s + BLOCK])
            corners = np.sort(mixes[block[:, :4].astype(np.int64) - 1], axis=1)
            rank = ranks[np.searchsorted(ends, np.arange(s, s + len(block)), side="right")]
            for k, seed in enumerate(TET_SEEDS):
                state = np.uint64(seed)
                for value in (*corners.T, block[:, 4], rank):
                    state = mix(state, value)
                lanes[k] += state.sum(dtype=np.uint64)
    found = f"{int(lanes[0]):016x}{int(lanes[1]):016x}"
    print(f"file:  {counts.get(TETRAHEDRA)} tetrahedra, {counts.get(VERTICES)} vertices, digest {found}")
    print(f"store: {info['tets']} tetrahedra, {info['vertices']} vertices, digest {info['digest']}")
    sys.exit(0 if (counts.get(TETRAHEDRA), found) == (info["tets"], info["digest"]) else 1)


if __name__ == "__main__":
    main()
