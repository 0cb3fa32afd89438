#!/usr/bin/env python3
"""Runs the commands of rows of benches/README.md again and rewrites their figures and commits.

  refresh.py --list                                   cases, and which of them this script can run
  refresh.py CASE... --dry-run                        the commands, without running them
  refresh.py CASE... --tetdb target/release/tetdb     runs them; --commit names the build [default: HEAD]

  refresh.py box-1M balls-0.4M --tetdb target/release/tetdb
  SURFACES=../surfaces refresh.py skull-hxt

A row is `| case | command | commit | figure | peer |`. The command may have several steps joined by `&&`; the last one is measured, once. In
it `tetdb` is the program, STORE a temporary store, OUT.vtu a temporary file, $SURFACES a folder of real surfaces from the environment.
`tetdb mesh` writes to STORE unless it says otherwise. A figure is a list of `number unit`; the units that can be measured are in UNITS
below. A number keeps its decimals. `2.0 × CASE` is the seconds of another case over this one's, `2.0 × peer` tetdb's tetrahedra per CPU second over the
peer's. The peer's figure is measured anew where the command is `peers.py speed`. Peers need the Python packages that peers.py needs, so run this with the same Python.
"""
import argparse
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
UNITS = {
    "tets": lambda m: m["tets"],
    "M tets": lambda m: m["tets"] / 1e6,
    "s": lambda m: m["wall"],
    "CPU s": lambda m: m["cpu"],
    "k tets/CPU s": lambda m: m["tets"] / m["cpu"] / 1e3,
    "MiB": lambda m: m["resident"] / 2**20,
    "B/tet held": lambda m: m["peak"] / m["tets"],
    "B/tet": lambda m: m["bytes"] / m["tets"],
    "B/tet with coarse": lambda m: (m["bytes"] + m["coarse"]) / m["tets"],
    "sub-domains": lambda m: len(m["parts"]),
    "% q<2": lambda m: m["good"],
    "worst q": lambda m: m["worst"],
    "most/mean": lambda m: max(m["parts"]) * len(m["parts"]) / sum(m["parts"]),
    "least/mean": lambda m: min(m["parts"]) * len(m["parts"]) / sum(m["parts"]),
    "% locally Delaunay": lambda m: 100 * m["verify"]["delaunay_faces"] / m["verify"]["delaunay_tested"],
    "MB/CPU s": lambda m: m["written"] / 1e6 / m["cpu"],
}
ITEM = re.compile(r"([\d.,]*\d)( \S.*)?$")


class Refused(Exception):
    """A row that this script cannot run, and why."""


def read_rows(lines):
    """Line number and cells of each row, by case."""
    rows = {}
    for at, line in enumerate(lines):
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if line.startswith("|") and len(cells) == 5 and cells[2].startswith("`"):
            rows[cells[0]] = (at, cells)
    return rows


def steps_of(command):
    return [shlex.split(step) for step in command.strip("`").split("&&")]


def refuse(cells):
    """Why a row cannot be run, if it cannot."""
    if not re.fullmatch("`[^`]+`", cells[1]):
        return "its command is described in words"
    last = steps_of(cells[1])[-1]
    if last[0] != "tetdb" and not (last[0].endswith("peers.py") and last[1] == "speed"):
        return f"{last[0]} is not run by this script"
    for item in filter(None, cells[3].split(", ")):
        found = ITEM.match(item)
        unit = (found.group(2) or "").strip() if found else item
        if not found or not (unit in UNITS or unit.startswith("× ")):
            return f"nothing measures {item!r}"
    return None


def measured(words):
    """Runs one step; CPU and clock seconds, peak resident bytes, and what it printed."""
    begun = time.perf_counter()
    with tempfile.TemporaryFile() as out:
        child = subprocess.Popen(words, stdout=out, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        wall = time.perf_counter() - begun
        if child.returncode:
            raise Refused(f"exit {child.returncode}: {' '.join(words)}")
        out.seek(0)
        text = out.read().decode()
    return {"wall": wall, "cpu": used.ru_utime + used.ru_stime, "resident": used.ru_maxrss * 1024}, text


def tetdb_words(step, program, folder):
    """The words of a step with its placeholders filled in, and the store it writes or reads."""
    store = os.path.join(folder, "STORE.tetdb")
    words = [os.path.expandvars(word) for word in step]
    words = [program if word == "tetdb" else store if word == "STORE" else os.path.join(folder, word) if word.startswith("OUT") else word
             for word in words]
    if words[1] == "mesh" and "-o" not in words:
        words += ["-o", store]
    return words, store


def of_store(program, store):
    info = json.loads(subprocess.run([program, "info", store, "--json"], check=True, capture_output=True).stdout)
    parts = info["subdomains"]
    bins = [sum(column) for column in zip(*(part["quality"]["bins"] for part in parts))]
    return {"tets": info["tets"], "bytes": info["bytes"], "coarse": info["coarse_bytes"],
            "parts": [part["tets"] for part in parts], "good": 100 * bins[0] / sum(bins), "worst": max(part["quality"]["worst"] for part in parts)}


def run_tetdb(steps, program):
    with tempfile.TemporaryDirectory() as folder:
        for step in steps:
            words, store = tetdb_words(step, program, folder)
            is_verify = words[1] == "verify"
            m, text = measured(words + ["--json"] * is_verify)
        if is_verify:
            m["verify"] = json.loads(text)
        m["written"] = sum(os.path.getsize(os.path.join(at, name)) for at, _, names in os.walk(folder) if ".tetdb" not in at for name in names)
        return m | of_store(program, store)


def run_peers(step, program):
    """Measures of tetdb and of the first other mesher, by the first number of threads."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "rows.json")
        script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "peers.py")
        words = [os.path.expandvars(word) for word in step[1:]]
        subprocess.run([sys.executable, script, *words, "--tetdb", program, "--json", path], check=True, stdout=subprocess.DEVNULL)
        rows = json.load(open(path))
    both = []
    for name in ("tetdb", next(row["mesher"] for row in rows if row["mesher"] != "tetdb")):
        row = next(row for row in rows if row["mesher"] == name)
        middle = sorted(row["runs"], key=lambda run: run["cpu"])[len(row["runs"]) // 2]
        both.append(middle | ({"good": row["measure"]["q12"], "worst": row["measure"]["worst"]} if row["measure"] else {}))
    return both


def seconds_of(case, rows, fresh):
    if case in fresh:
        return fresh[case]["wall"]
    for item in rows[case][1][3].split(", "):
        if item.endswith(" s") and ITEM.match(item).group(2) == " s":
            return float(item.split()[0].replace(",", ""))
    raise Refused(f"{case} has no seconds to compare with")


def value_of(unit, m, peer, rows, fresh):
    if unit == "× peer":
        return m["tets"] / m["cpu"] / peer["tets"] * peer["cpu"]
    return seconds_of(unit[2:], rows, fresh) / m["wall"] if unit.startswith("× ") else UNITS[unit](m)


def figure(old, m, peer, rows, fresh):
    """The same list of numbers and units, with what was measured."""
    items = []
    for item in filter(None, old.split(", ")):
        number, unit = ITEM.match(item).groups()
        unit = (unit or "").strip()
        decimals = len(number.partition(".")[2])
        items.append(f"{value_of(unit, m, peer, rows, fresh):,.{decimals}f} {unit}".strip())
    return ", ".join(items)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="*")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--dry-run", action="store_true")
    parser.add_argument("--tetdb", default="tetdb")
    parser.add_argument("--commit")
    parser.add_argument("--table", default=os.path.join(ROOT, "benches", "README.md"))
    args = parser.parse_args()
    with open(args.table) as file:
        lines = file.read().split("\n")
    rows = read_rows(lines)
    if args.list:
        for case, (_, cells) in rows.items():
            why = refuse(cells)
            print(f"{case:24} " + (f"by hand: {why}" if why else cells[1]))
        return
    if not args.case:
        parser.error("name a case, or --list")
    commit = args.commit or subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    fresh = {}
    for case in args.case:
        if case not in rows:
            sys.exit(f"{case}: no such case; --list shows them")
        at, cells = rows[case]
        if why := refuse(cells):
            sys.exit(f"{case}: {why}")
        steps = steps_of(cells[1])
        if args.dry_run:
            print(f"{case}: " + " && ".join(" ".join(step) for step in steps))
            continue
        peer = None
        if steps[-1][0] == "tetdb":
            fresh[case] = run_tetdb(steps, args.tetdb)
        else:
            fresh[case], peer = run_peers(steps[-1], args.tetdb)
        after = cells[:2] + [f"`{commit}`", figure(cells[3], fresh[case], peer, rows, fresh), cells[4]]
        if peer and ": " in cells[4] and refuse([*cells[:3], cells[4].partition(": ")[2], ""]) is None:
            name, _, old = cells[4].partition(": ")
            after[4] = f"{name}: {figure(old, peer, None, rows, fresh)}"
        lines[at] = "| " + " | ".join(after).rstrip() + " |"
        rows[case] = (at, after)
        print(f"{case}: {cells[3]} -> {after[3]}" + (f"; {cells[4]} -> {after[4]}" if peer else ""), flush=True)
        # After each case, so that a long list may be stopped.
        with open(args.table, "w") as file:
            file.write("\n".join(lines))


if __name__ == "__main__":
    try:
        main()
    except Refused as why:
        sys.exit(str(why))
