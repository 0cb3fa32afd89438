#!/usr/bin/env python3
"""Kills `tetdb resaturate` at random times: what is found afterwards must be the old mesh or the new one.

  kills.py TETDB STORE --subdomain LIST [--refine-by 0.9] [--kills 50] [--seed 1] [--verify-every 10]

STORE: a finished store, left as it was. The change is made once, timed and undone; then it is begun again and again and killed (SIGKILL) at a time drawn evenly from
that of a whole run and a twentieth more. After each kill the digests of all sub-domains and interfaces must be those of before or those of after; every fifth time an
old mesh is changed without a kill, and each new one is undone. Prints a line of JSON for each kill and a summary.
"""
import argparse
import json
import random
import subprocess
import sys
import time


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tetdb")
    parser.add_argument("store")
    parser.add_argument("--subdomain", required=True)
    parser.add_argument("--refine-by", default="0.9")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--verify-every", type=int, default=10)
    args = parser.parse_args()
    change = ["resaturate", args.store, "--subdomain", args.subdomain, "--refine-by", args.refine_by, "--no-verify"]

    def run(*words):
        done = subprocess.run([args.tetdb, *words], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{' '.join(words)}: exit {done.returncode}\n{done.stderr}")
        return done.stdout

    def mesh():
        info = json.loads(run("info", args.store, "--json"))
        parts = [(s["id"], s["digest"], s["interface_digest"]) for s in info["subdomains"]]
        return json.dumps([parts, info["interfaces"], info["regions"]])

    draw = random.Random(args.seed)
    old = mesh()
    begun = time.time()
    run(*change)
    whole = time.time() - begun
    new = mesh()
    if old == new:
        sys.exit("the change changes nothing: choose another --refine-by")
    run("resaturate", args.store, "--undo", "--no-verify")
    counts = {"old": 0, "new": 0}
    for kill in range(args.kills):
        wait = draw.uniform(0, 1.05 * whole)
        child = subprocess.Popen([args.tetdb, *change], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            child.wait(wait)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
        found = mesh()
        if found not in (old, new):
            sys.exit(f"kill {kill} after {wait:.3f} s left a mesh that is neither the old one nor the new one")
        word = "old" if found == old else "new"
        counts[word] += 1
        print(json.dumps({"kill": kill, "after_s": round(wait, 3), "exit": child.returncode, "found": word}), flush=True)
        if args.verify_every and kill % args.verify_every == 0:
            run("verify", args.store)
        if word == "old" and kill % 5 == 4:
            run(*change)
            if mesh() != new:
                sys.exit(f"after kill {kill} the change gave another mesh")
            word = "new"
        if word == "new":
            run("resaturate", args.store, "--undo", "--no-verify")
            if mesh() != old:
                sys.exit(f"after kill {kill} undoing gave another mesh")
    print(json.dumps({"kills": args.kills, "seed": args.seed, "whole_s": round(whole, 2), **counts}))


if __name__ == "__main__":
    main()
