#!/usr/bin/env python3
"""Kills `tetdb export` at random times, fills its disk, and compares the pieces of many writers, format by format.

  export_kills.py TETDB STORE FOLDER [--small FOLDER] [--kills 20] [--seed 1]

STORE has two sub-domains or more. FOLDER is made and removed. After each kill (SIGKILL, at a time drawn evenly from that of a whole export)
nothing may have a name yet, or all files of a whole export with its bytes; the next export must remove what was left in hidden folders and
write the same bytes. Pieces are written by one process, by one process each, and by two at once, and compared. --small: a folder on a file
system with less room than most exports need (a tmpfs of 1 MiB): each that does not fit must end with exit code 6 and leave it empty. Exit
code 0 when all hold.
"""
import argparse
import hashlib
import json
import os
import random
import shutil
import subprocess
import sys
import time

NAMES = ["a.vtu", "a.pvtu", "a.vtkhdf", "a.foam", "a.msh", "a.mesh", "a.meshb", "a.mfem", "a.inp", "a.ele", "a.npy", "a.json"]
PIECES = ["a.vtu", "a.foam", "a.msh", "a.mesh", "a.meshb", "a.mfem", "a.inp", "a.ele", "a.npy"]
CASES = [[n] for n in NAMES] + [["a.msh", "--format", "msh22"], ["a.msh", "--ghosts"], ["a.msh", "--pieces", "--ghosts"],
         ["a.foam", "--pieces"], ["a.mfem", "--pieces"], ["a.vtu", "--order", "2"], ["a.vtkhdf", "--region", "1"]]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tetdb")
    parser.add_argument("store")
    parser.add_argument("folder")
    parser.add_argument("--small")
    parser.add_argument("--kills", type=int, default=20, help="of each format")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    draw, wrong = random.Random(args.seed), 0
    tetdb, store = os.path.abspath(args.tetdb), os.path.abspath(args.store)

    def complain(words, text):
        nonlocal wrong
        wrong += 1
        print("WRONG:", *words, text)

    def begin(folder, words):
        os.makedirs(folder, exist_ok=True)
        return subprocess.Popen([tetdb, "export", "-q", store, *words], cwd=folder, stderr=subprocess.PIPE, text=True)

    def export(folder, words):
        shutil.rmtree(folder, ignore_errors=True)
        child = begin(folder, words)
        said = child.communicate()[1]
        if child.returncode:
            sys.exit(f"export {' '.join(words)}: exit {child.returncode}\n{said}")
        return files(folder)

    def files(folder):
        """Digests of all files with a name, and the hidden folders."""
        named, hidden = {}, []
        for at, folders, names in os.walk(folder):
            hidden += [f for f in folders if f.startswith(".")]
            folders[:] = [f for f in folders if not f.startswith(".")]
            for name in names:
                path = os.path.join(at, name)
                named[os.path.relpath(path, folder)] = hashlib.sha256(open(path, "rb").read()).hexdigest()
        return named, hidden

    folder = os.path.abspath(args.folder)
    for words in CASES:
        begun = time.time()
        whole, hidden = export(folder, words)
        size = sum(os.path.getsize(os.path.join(folder, name)) for name in whole)
        seconds, counts = time.time() - begun, {"nothing": 0, "all": 0}
        if hidden:
            complain(words, f"left {hidden}")
        shutil.rmtree(folder)
        for _ in range(args.kills):
            child = begin(folder, words)
            time.sleep(draw.uniform(0, seconds))
            child.kill()
            child.communicate()
            named, _ = files(folder)
            if named not in ({}, whole):
                complain(words, f"after a kill {len(named)} of {len(whole)} files are there, or others")
            counts["all" if named else "nothing"] += 1
            for name in named:
                os.remove(os.path.join(folder, name))
        child = begin(folder, words)
        child.communicate()
        after = files(folder)
        if after != (whole, []):
            complain(words, f"the export after the kills is another, or left {after[1]}")
        line = {"export": " ".join(words), "files": len(whole), "seconds": round(seconds, 2), "killed with nothing": counts["nothing"], "with all": counts["all"]}
        # What fits is no test.
        if args.small and size > shutil.disk_usage(args.small).free:
            child = begin(args.small, words)
            said = child.communicate()[1]
            line["full disk"] = child.returncode
            if child.returncode != 6 or os.listdir(args.small):
                complain(words, f"on a full disk: exit {child.returncode}, {os.listdir(args.small)} there\n{said}")
        print(json.dumps(line), flush=True)
    parts = len(json.loads(subprocess.run([tetdb, "info", store, "--json"], capture_output=True, check=True).stdout)["subdomains"])
    for name in PIECES:
        words = [name, "--pieces", *(["--ghosts"] if name == "a.msh" else [])]
        (whole, _), before = export(folder, words), wrong
        for at_once in (1, 2):
            shutil.rmtree(folder)
            for first in range(0, parts, at_once):
                children = [begin(folder, [*words, "--subdomain", str(k)]) for k in range(first, min(first + at_once, parts))]
                for child in children:
                    child.communicate()
            if files(folder) != (whole, []):
                complain(words, f"pieces of {at_once} writers at once differ from those of one")
        print(json.dumps({"export": " ".join(words), "files": len(whole), "alike whoever writes": wrong == before}), flush=True)
    shutil.rmtree(folder)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
