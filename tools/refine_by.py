#!/usr/bin/env python3
"""A finished mesh made again with lengths times a factor: what becomes of counts and qualities, and whether undo brings back the old.

  refine_by.py TETDB SURFACE... [--factors 0.5,0.8,0.9,1,1.25] [--subdomains 1,4] [--mesh "--regions all"]

TETDB: the program. SURFACE: a file, or a sample with options of its own in the same word, as in "sample:box,h=0.1 --size-sphere 0,0,0,0.2,0.01". Each is meshed once for each
number of sub-domains; all sub-domains are made again with each factor, and brought back. Prints a table of counts, share of q < 2, share of excess < 2 (quality over the least that the
surface allows), worst q and worst excess; an exclamation mark where a share falls by more than a point, or a worst grows by more than a tenth. Exit code 1 when a digest after undo is not
the old one, or a factor below 1 gives fewer tetrahedra.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile


def run(*words):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stderr}")
    return done.stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tetdb")
    parser.add_argument("surfaces", nargs="+")
    parser.add_argument("--factors", default="0.5,0.8,0.9,1,1.25")
    parser.add_argument("--subdomains", default="1,4")
    parser.add_argument("--mesh", default="--regions all")
    args = parser.parse_args()
    factors = args.factors.split(",")
    is_good = True
    print("| surface | sub-domains | tetrahedra, q < 2, excess < 2, worst q, worst excess | " + " | ".join(f"× {f}" for f in factors) + " |")
    print("|" + "---|" * (3 + len(factors)))
    for surface in args.surfaces:
        done = set()
        for n in args.subdomains.split(","):
            with tempfile.TemporaryDirectory() as folder:
                is_good &= row(args, surface, n, factors, pathlib.Path(folder) / "a.tetdb", done)
    return 0 if is_good else 1


def state(args, store):
    info = json.loads(run(args.tetdb, "info", store, "--json"))
    parts = info["subdomains"]
    tets = sum(part["tets"] for part in parts)
    good = sum(part["quality"]["bins"][0] for part in parts)
    worst = max(part["quality"]["worst"] for part in parts)
    ask = [args.tetdb, "query", store, "--quiet", "--select", "excess", "--csv"]
    bad = len(run(*ask, "--where", "excess >= 2").splitlines()) - 1
    most = run(*ask, "--order-by", "excess", "--desc", "--limit", "1").splitlines()[1]
    return info["digest"], len(parts), tets, [100 * good / tets, 100 - 100 * bad / tets], [worst, float(most)]


def words(shares, worst, old=None):
    was_shares, was_worst = old or (shares, worst)
    shares = [f"{now:.1f} %" + "!" * (now < was - 1) for now, was in zip(shares, was_shares)]
    worst = [f"{now:.4g}" + "!" * (now > 1.1 * was) for now, was in zip(worst, was_worst)]
    return ", ".join(shares + worst)


def row(args, surface, n, factors, store, done):
    file, *options = surface.split()
    common = ["--threads", "1", "--no-verify", "--quiet"]
    run(args.tetdb, "mesh", file, *options, *args.mesh.split(), "-o", store, "--subdomains", n, *common)
    digest, n, tets, *old = state(args, store)
    # A small mesh is not divided as often as asked for.
    if n in done:
        return True
    done.add(n)
    name = pathlib.Path(file).name
    cells, is_good = [], True
    for factor in factors:
        ranks = ",".join(map(str, range(n)))
        run(args.tetdb, "resaturate", store, "--subdomain", ranks, "--refine-by", factor, *common)
        changed, _, now, *new = state(args, store)
        # What is the same mesh is no change, and not undone.
        if changed != digest:
            run(args.tetdb, "resaturate", store, "--undo", "--no-verify", "--quiet")
        is_good &= state(args, store)[0] == digest and (float(factor) >= 1 or now >= tets)
        cells.append(f"{now:,} ({now / tets:.3f}), {words(*new, old)}")
    print(f"| {name}{' ' if options else ''}{' '.join(options)} | {n} | {tets:,}, {words(*old)} | " + " | ".join(cells) + " |", flush=True)
    return is_good


if __name__ == "__main__":
    sys.exit(main())
