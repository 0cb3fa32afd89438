#!/usr/bin/env python3
"""Kills tetdb at random times (SIGKILL) and checks what is left: nothing may be lost, mixed or half written.

  kills.py mesh     TETDB STORE --subdomain LIST [--refine-by 0.9] [--kills 50] [--verify-every 10]
  kills.py changes  TETDB FOLDER [--versions 200] [--fields 100]
  kills.py export   TETDB STORE FOLDER [--small FOLDER] [--kills 20]
  kills.py carriers TETDB FOLDER [--mpi PROGRAM=MPIRUN] [--ranks N] [--tasks N] [--gathers N] [--steps] [--slurm N] [--races N] [--late]

`mesh` kills `tetdb resaturate`: the store has the old mesh or the new one. `changes` does the same with versions and fields. `export` kills `tetdb export` of every format, fills its disk,
and compares the pieces of many writers. `carriers` kills ranks of MPI, tasks and gathers. Each sub-command has its own --help.

  tetdb mesh sample:box,h=0.05 -o box.tetdb --subdomains 4
  kills.py mesh tetdb box.tetdb --subdomain 1 --kills 10
  kills.py changes tetdb /tmp/changes --versions 6 --fields 4 --job sample:box,h=0.045
  kills.py export tetdb box.tetdb /tmp/exports --kills 3
  kills.py carriers tetdb /tmp/carriers --tasks 20 --gathers 10 --late

--seed chooses the times. Exit code 0 when everything was as it has to be.
"""
import argparse
import functools
import hashlib
import json
import os
import random
import shutil
import subprocess
import sys
import time

TOOLS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, TOOLS)
from carriers import ENV, Bench, Differs, run  # noqa: E402

NAMES = ["a.vtu", "a.pvtu", "a.vtkhdf", "a.xdmf", "a.exo", "a.bdf", "a.foam", "a.msh", "a.mesh", "a.meshb", "a.mfem", "a.inp", "a.su2", "a.ele", "a.npy", "a.json"]
PIECES = ["a.vtu", "a.xdmf", "a.exo", "a.bdf", "a.foam", "a.msh", "a.mesh", "a.meshb", "a.mfem", "a.inp", "a.su2", "a.ele", "a.npy"]
CASES = [[n] for n in NAMES] + [["a.msh", "--format", "msh22"], ["a.msh", "--ghosts"], ["a.msh", "--pieces", "--ghosts"],
         ["a.foam", "--pieces"], ["a.mfem", "--pieces"], ["a.vtu", "--order", "2"], ["a.vtkhdf", "--region", "1"]]
KILLS_PER_MESH = 6
STEPS = ["rename", "link", "linkat", "unlink", "unlinkat", "mkdir", "rmdir", "fsync", "fdatasync", "copy_file_range", "ftruncate"]
LOCKS = {"as they are": [], "refused": ["error=ENOLCK"], "given to all": ["retval=0"]}


def called(args, *words):
    """What the program prints; ends the script where it fails."""
    done = subprocess.run([args.tetdb, *words], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"WRONG: {' '.join(words)}: exit {done.returncode}\n{done.stderr}")
    return done.stdout


def mesh(args):
    """The change is made once, timed and undone. Then it is begun again and again, and killed at a time drawn evenly from that of a whole run
    and a twentieth more. After each kill the digests of all sub-domains and interfaces must be those of before or those of after. Every
    fifth time an old mesh is changed without a kill; each new one is undone. Prints a line of JSON for each kill and a summary."""
    change = ["resaturate", args.store, "--subdomain", args.subdomain, "--refine-by", args.refine_by, "--no-verify"]

    run = functools.partial(called, args)

    def state():
        info = json.loads(run("info", args.store, "--json"))
        parts = [(s["id"], s["digest"], s["interface_digest"]) for s in info["subdomains"]]
        return json.dumps([parts, info["interfaces"], info["regions"]])

    draw = random.Random(args.seed)
    old = state()
    begun = time.time()
    run(*change)
    whole = time.time() - begun
    new = state()
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
        found = state()
        if found not in (old, new):
            sys.exit(f"kill {kill} after {wait:.3f} s left a mesh that is neither the old one nor the new one")
        word = "old" if found == old else "new"
        counts[word] += 1
        print(json.dumps({"kill": kill, "after_s": round(wait, 3), "exit": child.returncode, "found": word}), flush=True)
        if args.verify_every and kill % args.verify_every == 0:
            run("verify", args.store)
        if word == "old" and kill % 5 == 4:
            run(*change)
            if state() != new:
                sys.exit(f"after kill {kill} the change gave another mesh")
            word = "new"
        if word == "new":
            run("resaturate", args.store, "--undo", "--no-verify")
            if state() != old:
                sys.exit(f"after kill {kill} undoing gave another mesh")
    print(json.dumps({"kills": args.kills, "seed": args.seed, "whole_s": round(whole, 2), **counts}))


def changes(args):
    """FOLDER is created and removed. A store gets two versions whose meshes differ, and a field. `version save`, `restore` and `drop`,
    `field add` and `drop` are each killed at times drawn evenly from that of a whole run, timed before, and a third more. Five kills in
    turn meet one store. After each, mesh, fields and versions are those of before or of after, `verify` passes for the store and for
    all its versions, and once the change has gone through, there are as many files as without kills."""
    draw, folder = random.Random(args.seed), os.path.abspath(args.folder)
    store, first = os.path.join(folder, "store.tetdb"), os.path.join(folder, "first.tetdb")
    os.makedirs(folder)

    call = functools.partial(called, args)

    def state():
        info = json.loads(call("info", store, "--json"))
        versions = json.loads(call("version", store, "list", "--json"))["versions"]
        times_apart = [{k: v for k, v in version.items() if k not in ("saved", "bytes")} for version in versions]
        return json.dumps([info["digest"], info["fields"], times_apart]), [version["name"] for version in versions]

    def files():
        """How many there are of each, whatever their generation."""
        names = sorted(name.rsplit("-g", 1)[0] for _, _, names in os.walk(store) for name in names)
        return [name for name in names if not name.endswith(".lock")]

    def begin():
        shutil.rmtree(store, ignore_errors=True)
        shutil.copytree(first, store)

    call("mesh", *args.job.split(), "--subdomains", "4", "-o", first)
    call("field", first, "add", "base", "--at", "tets", "--from", "quality")
    call("version", first, "save", "a")
    call("resaturate", first, "--subdomain", "1", "--refine-by", "0.8")
    call("version", first, "save", "b")
    call("resaturate", first, "--subdomain", "0,2", "--refine-by", "0.9")
    n_tets = json.loads(call("info", first, "--json"))["tets"]
    versions = [["version", store, "save", "c"], ["version", store, "restore", "a", "--no-verify"], ["version", store, "drop", "b"]]
    fields = [["field", store, "add", "more", "--at", "tets", "--from", "x, y, z"], ["field", store, "drop", "base"]]
    for group, n in ((versions, args.versions), (fields, args.fields)):
        for number, change in enumerate(group):
            begin()
            old = state()[0]
            begun = time.time()
            call(*change)
            whole, (new, _), kept = time.time() - begun, state(), files()
            counts = {"hit": 0, "old": 0, "new": 0}
            for kill in range(n * number // len(group), n * (number + 1) // len(group)):
                if kill % 5 == 0:
                    begin()
                    begun = time.time()
                    call(*change)
                    whole = time.time() - begun
                    begin()
                child = subprocess.Popen([args.tetdb, *change], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                try:
                    child.wait(draw.uniform(0, 1.3 * whole))
                except subprocess.TimeoutExpired:
                    child.kill()
                    child.wait()
                counts["hit"] += child.returncode == -9
                found, names = state()
                if found not in (old, new):
                    sys.exit(f"WRONG: kill {kill} of {change[0]} {change[2]} left neither the old state nor the new one: {found}")
                counts["old" if found == old else "new"] += 1
                call("verify", store)
                for name in names:
                    call("verify", store, "--at-version", name)
                if found == old and kill % 5 < 4:
                    continue
                if found == old:
                    call(*change)
                # What a killed writer left goes with the next one.
                call("version", store, "save", "last")
                call("version", store, "drop", "last")
                if state()[0] != new or files() != kept:
                    sys.exit(f"WRONG: after kills of {change[0]} {change[2]} there are {files()} instead of {kept}")
                begin()
            line = {"change": f"{change[0]} {change[2]}", "tets": n_tets, "whole_s": round(whole, 3), "files": len(kept), **counts}
            print(json.dumps(line), flush=True)
    shutil.rmtree(folder)


def export(args):
    """STORE has two sub-domains or more; FOLDER is created and removed. After each kill, at a time drawn evenly from that of a whole export,
    either no file has its name yet, or all files of a whole export have their names and bytes. The next export must remove what was left
    in hidden folders and write the same bytes. Pieces are written by one process, by one process each, and by two at once, and compared.
    --small: a folder on a file system too small for most exports (a tmpfs of 1 MiB). An export that does not fit must end with exit code 6
    and leave the folder empty."""
    draw, wrong = random.Random(args.seed), 0
    tetdb, store = os.path.abspath(args.tetdb), os.path.abspath(args.store)

    def complain(words, text):
        nonlocal wrong
        wrong += 1
        print("WRONG:", *words, text)

    def begin(folder, words):
        os.makedirs(folder, exist_ok=True)
        return subprocess.Popen([tetdb, "export", "-q", store, *words], cwd=folder, stderr=subprocess.PIPE, text=True)

    def export_all(folder, words):
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
        whole, hidden = export_all(folder, words)
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
        (whole, _), before = export_all(folder, words), wrong
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
    return 1 if wrong else 0


class Kills(Bench):
    def __init__(self, args):
        args.tasks_at_once = 3
        super().__init__(argparse.Namespace(**{**vars(args), "tasks": 3}))
        self.seed, self.serial = args.seed, 0
        self.program = hashlib.sha256(open(self.tetdb, "rb").read()).hexdigest()[:12]
        self.log = os.path.join(self.folder, "kills.jsonl")
        lines = map(json.loads, open(self.log)) if os.path.exists(self.log) else ()
        self.done = [line for line in lines if line["program"] == self.program]
        self.draw = random.Random(f"{args.seed} {len(self.done)}")
        self.begin(args.job)

    def known(self, kind):
        return sum(line["n"] for line in self.done if line["kind"] == kind)

    def note(self, kind, n, **more):
        line = {"kind": kind, "n": n, "program": self.program, "job": " ".join(self.job), "seed": self.seed, **more}
        with open(self.log, "a") as file:
            print(json.dumps(line), file=file)
        print(json.dumps(line), flush=True)
        self.done.append(line)

    def spawn(self, words, **more):
        return subprocess.Popen(words, env=more.pop("env", ENV), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more)

    def kill_within(self, child, seconds):
        """Whether it still ran after a random time within so many seconds; it has ended then."""
        try:
            child.communicate(timeout=self.draw.uniform(0, seconds))
            return False
        except subprocess.TimeoutExpired:
            child.kill()
            child.communicate()
            return True

    def tasks_left(self, store):
        info = json.loads(run([self.tetdb, "info", store, "--json"]))
        return [state["task"] for state in info["tasks"]["states"]] if info.get("tasks") else []

    def work(self, store, task):
        return [self.tetdb, "work", store, "--task", str(task), "--threads", "1", "--memory", self.memory, "-q", "--scratch", self.local()]

    def local(self):
        path = os.path.join(self.folder, "local")
        os.makedirs(path, exist_ok=True)
        return path

    def planned(self, name):
        store = self.coarse(name)
        run([self.tetdb, "plan", store, "--tasks", str(self.tasks), "-q"])
        return store

    def gather(self, store):
        """Gathers; whether the store is finished. Tasks that were killed may be left."""
        done = subprocess.run([self.tetdb, "gather", store, "--json", "--wait", "0"], capture_output=True, text=True)
        if done.returncode not in (0, 8):
            raise Differs(f"gather: exit {done.returncode}\n{done.stderr}")
        return done.returncode == 0 and json.loads(done.stdout)["finished"]

    def ranks(self, n):
        program, launcher = self.mpis[0]
        store = os.path.join(self.folder, "killed.tetdb")

        def words():
            what = ["resume", store] if os.path.exists(store) else ["mesh", *self.job, "-o", store]
            return [launcher, "-n", "4", program, *what, *self.run_options()]

        begun = time.time()
        shutil.rmtree(store, ignore_errors=True)
        run(words())
        whole = time.time() - begun
        self.check(store)
        while self.known("rank") < n:
            killed = []
            while len(killed) < KILLS_PER_MESH:
                child = self.spawn(words(), cwd=self.folder)
                # Later kills find less to do.
                time.sleep(self.draw.uniform(0.1, 0.8) * whole / (1 + len(killed)))
                ranks = self.processes(program)
                if child.poll() is None and ranks:
                    victim = self.draw.choice(ranks)
                    try:
                        os.kill(victim, 9)
                        killed.append(round(time.time() - begun, 2))
                    except ProcessLookupError:
                        pass
                self.wait(child, program)
                if child.returncode == 0:
                    break
            run(words())
            self.check(store)
            self.note("rank", len(killed), mpirun=os.path.basename(launcher))

    def wait(self, child, program):
        """Waits for a launcher. Open MPI's sometimes waits for a lock of its own (in PMIx_server_finalize) after its ranks are gone; it is
        killed then. Ranks that are still there after two minutes are an error."""
        n_without_ranks = 0
        for _ in range(24):
            try:
                child.communicate(timeout=5)
                return
            except subprocess.TimeoutExpired:
                n_without_ranks = 0 if self.processes(program) else n_without_ranks + 1
            if n_without_ranks == 2:
                child.kill()
        child.kill()
        raise Differs(f"ranks {self.processes(program)} go on after one was killed")

    def processes(self, program):
        found = []
        for pid in filter(str.isdigit, os.listdir("/proc")):
            try:
                if os.readlink(f"/proc/{pid}/exe") == program and os.readlink(f"/proc/{pid}/cwd") == self.folder:
                    found.append(int(pid))
            except OSError:
                pass
        return sorted(found)

    def tasks_and_gathers(self, n_tasks, n_gathers):
        while self.known("task") < n_tasks or self.known("gather") < n_gathers:
            store = self.planned("killed")
            n = {"task": 0, "gather": 0}
            took = 1.0
            while True:
                for task in self.tasks_left(store):
                    for _ in range(4):
                        n["task"] += self.kill_within(self.spawn(self.work(store, task)), 1.1 * took)
                    begun = time.time()
                    run(self.work(store, task))
                    took = max(0.1, time.time() - begun)
                for _ in range(6):
                    n["gather"] += self.kill_within(self.spawn([self.tetdb, "gather", store, "--wait", "0"]), 0.15)
                if self.gather(store):
                    break
            self.after_kills(store)
            for kind, count in n.items():
                self.note(kind, count)

    def after_kills(self, store):
        # A task that is killed leaves its folder on its machine, which the scheduler's folder of a job goes with.
        shutil.rmtree(self.local())
        self.check(store)

    def steps(self):
        if self.known("step"):
            return
        store = self.planned("killed")
        before = self.store("before")
        counts = {}

        def until_through(words):
            for call in STEPS:
                # What went through once would be done already.
                shutil.rmtree(store)
                shutil.copytree(before, store)
                for when in range(1, 200):
                    inject = ["-e", f"trace={call}", "-e", f"inject={call}:signal=KILL:when={when}"]
                    child = subprocess.run(["strace", "-f", "-qq", "-o", "/dev/null", *inject, *words], capture_output=True, text=True)
                    if child.returncode in (0, 8):
                        break
                    if child.returncode not in (-9, 137):
                        raise Differs(f"{words} killed at {call} {when}: exit {child.returncode}\n{child.stderr}")
                    counts[f"{words[1]} {call}"] = when

        while True:
            for i, task in enumerate(self.tasks_left(store)):
                if i == 0:
                    shutil.copytree(store, before)
                    until_through(self.work(store, task))
                    shutil.rmtree(before)
                run(self.work(store, task))
            shutil.copytree(store, before)
            until_through([self.tetdb, "gather", store, "--wait", "0"])
            shutil.rmtree(before)
            if self.gather(store):
                break
        self.after_kills(store)
        self.note("step", sum(counts.values()), at=counts)

    def slurm(self, n):
        slurm = run(["mktemp", "-d"]).strip()
        tool = os.path.join(TOOLS, "slurm-here.sh")
        env = dict(ENV, SLURM_CONF=os.path.join(slurm, "slurm.conf"))
        try:
            subprocess.run([tool, "start", slurm], check=True, stdout=subprocess.DEVNULL)
            while self.known("slurm") < n:
                store, killed = self.coarse("slurm"), 0
                while True:
                    script = self.script(store, "slurm")
                    if not open(script).read():
                        break
                    subprocess.run(["sh", script], cwd=self.folder, env=env, check=True, stdout=subprocess.DEVNULL)
                    while subprocess.run(["squeue", "-h"], env=env, capture_output=True).stdout:
                        tasks = [p for p in self.processes(self.tetdb) if b"work" in open(f"/proc/{p}/cmdline", "rb").read().split(b"\0")]
                        if tasks and killed < 12 and self.draw.random() < 0.3:
                            os.kill(self.draw.choice(tasks), 9)
                            killed += 1
                        time.sleep(0.2)
                    if json.loads(run([self.tetdb, "info", store, "--json"]))["finished"]:
                        break
                self.check(store)
                self.note("slurm", killed)
        finally:
            subprocess.run([tool, "stop", slurm], check=False)
            shutil.rmtree(slurm, ignore_errors=True)

    def races(self, n):
        kinds = list(LOCKS)
        while self.known("race") < n:
            number = self.known("race")
            locks = kinds[number % len(kinds)]
            stub = [w for how in LOCKS[locks] for w in ("strace", "-f", "-qq", "-o", "/dev/null", "-e", "trace=flock", "-e", f"inject=flock:{how}")]
            refused = 0

            def two(words):
                nonlocal refused
                first = self.spawn([*stub, *words])
                time.sleep(self.draw.uniform(0, 0.3))
                both = [first, self.spawn([*stub, *words])]
                said = [child.communicate(timeout=600) for child in both]
                codes = sorted(child.returncode for child in both)
                refused += codes.count(5)
                if codes not in ([0, 0], [0, 5], [0, 8], [5, 8], [8, 8]):
                    raise Differs(f"{words}: exits {codes}\n{said}")

            if number % 2:
                store = self.store("race")
                two([self.tetdb, "mesh", *self.job, "-o", store, *self.run_options()])
            else:
                store = self.planned("race")
                while tasks := self.tasks_left(store):
                    for task in tasks:
                        run(self.work(store, task))
                    two([self.tetdb, "gather", store, "--wait", "0"])
            self.check(store)
            self.note("race", 1, locks=locks, what="mesh" if number % 2 else "gather", refused=refused)

    def late(self):
        if self.known("late"):
            return
        library = os.path.join(self.folder, "late.so")
        run(["cc", "-shared", "-fPIC", "-O1", "-o", library, os.path.join(TOOLS, "late.c"), "-ldl"])
        env = dict(ENV, LD_PRELOAD=library, LATE_SECONDS="2", LATE_BELOW=self.folder)
        store = self.planned("late")
        begun, again = time.time(), 0

        def patient(words):
            done = subprocess.run(words, capture_output=True, text=True, env=env)
            if done.returncode:
                raise Differs(f"{words}: exit {done.returncode}\n{done.stderr}")
            return done.stdout

        while True:
            for task in self.tasks_left(store):
                patient(self.work(store, task))
                again += 1
            if json.loads(patient([self.tetdb, "gather", store, "--json"]))["finished"]:
                break
        self.check(store)
        if self.mpis:
            program, launcher = self.mpis[0]
            store = self.store("late")
            patient([launcher, "-n", "3", program, "mesh", *self.job, "-o", store, *self.run_options()])
            self.check(store)
        self.note("late", again, wall_s=round(time.time() - begun, 1))


def carriers(args):
    """Kills ranks, tasks and gathers, lets two runs meet, and shows files late: the mesh must be that of one process, with its files and no
    others. A line of JSON for each mesh goes to FOLDER/kills.jsonl, with what was killed; what is counted there with this program is not
    done again."""
    kills = Kills(args)
    try:
        if args.late:
            kills.late()
        if args.steps:
            kills.steps()
        if args.tasks or args.gathers:
            kills.tasks_and_gathers(args.tasks, args.gathers)
        if args.races:
            kills.races(args.races)
        if args.ranks:
            kills.ranks(args.ranks)
        if args.slurm:
            kills.slurm(args.slurm)
    except Differs as error:
        sys.exit(f"WRONG: {error}")
    shutil.rmtree(kills.one)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(function, *names):
        sub = commands.add_parser(function.__name__, description=function.__doc__)
        sub.set_defaults(function=function)
        for name in names:
            sub.add_argument(name)
        sub.add_argument("--seed", type=int, default=1)
        return sub

    sub = command(mesh, "tetdb", "store")
    sub.add_argument("--subdomain", required=True)
    sub.add_argument("--refine-by", default="0.9")
    sub.add_argument("--kills", type=int, default=50)
    sub.add_argument("--verify-every", type=int, default=10)
    sub = command(changes, "tetdb", "folder")
    sub.add_argument("--versions", type=int, default=200)
    sub.add_argument("--fields", type=int, default=100)
    sub.add_argument("--job", default="sample:box,h=0.031")
    sub = command(export, "tetdb", "store", "folder")
    sub.add_argument("--small")
    sub.add_argument("--kills", type=int, default=20, help="of each format")
    sub = command(carriers, "tetdb", "folder")
    sub.add_argument("--mpi", action="append", default=[], metavar="PROGRAM=MPIRUN")
    sub.add_argument("--job", default="sample:box,h=0.04 --subdomains 4")
    sub.add_argument("--memory", default="96MiB")
    for kind, text in (("ranks", "kills of a random rank of four; `resume` goes on, or `mesh` where there is no store yet"),
                       ("tasks", "kills of `tetdb work`"), ("gathers", "kills of `tetdb gather`"),
                       ("slurm", "kills of random tasks of arrays of a Slurm of one node, started here"),
                       ("races", "two runs at once on one store (`mesh`, `gather`); for a third of them strace refuses locks (ENOLCK), for a "
                                 "third it gives every lock")):
        sub.add_argument(f"--{kind}", type=int, default=0, metavar="N", help=text)
    sub.add_argument("--steps", action="store_true", help="kill at every rename, link, unlink, sync and folder of one task and one gather, by strace")
    sub.add_argument("--late", action="store_true", help="new files are hidden from other processes for two seconds (needs cc)")
    args = parser.parse_args()
    sys.exit(args.function(args))


if __name__ == "__main__":
    main()
