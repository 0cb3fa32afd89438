#!/usr/bin/env python3
"""Kills ranks, tasks and gathers, lets two runs meet, and shows files late: the mesh must be that of one process, with its files and no others.

  carrier_kills.py TETDB FOLDER [--mpi PROGRAM=MPIRUN] [--job "SURFACE --subdomains N"] [--memory 96MiB] [--ranks 100] [--tasks 100]
                   [--gathers 50] [--steps] [--slurm 20] [--races 50] [--late] [--seed 1]

--ranks: so many SIGKILLs of a random rank of four at a random time; after each `resume` goes on, or `mesh` where there is no store yet.
--tasks, --gathers: so many SIGKILLs of `tetdb work` and `tetdb gather` at a random time of theirs.
--steps: SIGKILL at every single rename, link, unlink, sync and folder of one task and one gather of each stage, by strace.
--slurm: so many SIGKILLs of random tasks of arrays of a Slurm of one node, started here; after each script the same script again.
--races: so many times two runs at once on one store (`mesh` and `mesh`, `gather` and `gather`), a third of them where locks are refused
(ENOLCK) and a third where everybody gets the lock it asks for, by strace.
--late: names of new files are hidden from other processes for two seconds, by a library that is loaded before others (needs cc).

A line of JSON for each mesh goes to FOLDER/kills.jsonl, with what was killed; what is counted there with this program is not done again.
Exit code 0 when every mesh was the same.
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

from carriers import ENV, HERE, Bench, Differs, run

KILLS_PER_MESH = 6
STEPS = ["rename", "link", "linkat", "unlink", "unlinkat", "mkdir", "rmdir", "fsync", "fdatasync", "copy_file_range", "ftruncate"]
LOCKS = {"as they are": [], "refused": ["error=ENOLCK"], "given to all": ["retval=0"]}


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
                child.communicate(timeout=120)
                if child.returncode == 0:
                    break
            run(words())
            self.check(store)
            self.note("rank", len(killed), mpirun=os.path.basename(launcher))

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
        tool = os.path.join(HERE, "slurm-here.sh")
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
        run(["cc", "-shared", "-fPIC", "-O1", "-o", library, os.path.join(HERE, "late.c"), "-ldl"])
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tetdb")
    parser.add_argument("folder")
    parser.add_argument("--mpi", action="append", default=[])
    parser.add_argument("--job", default="sample:box,h=0.04 --subdomains 4")
    parser.add_argument("--memory", default="96MiB")
    for kind in ("ranks", "tasks", "gathers", "slurm", "races"):
        parser.add_argument(f"--{kind}", type=int, default=0, metavar="N")
    parser.add_argument("--steps", action="store_true")
    parser.add_argument("--late", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
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


if __name__ == "__main__":
    main()
