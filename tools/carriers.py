#!/usr/bin/env python3
"""Makes meshes with every carrier there is, and compares each with that of one process: digest, files, verification.

  carriers.py TETDB FOLDER [--mpi PROGRAM=MPIRUN ...] [--ranks 2,4] [--job "SURFACE --subdomains N ..." ...] [--memory 96MiB]
              [--tasks 3] [--only WORD,...] [--require]

Carriers: `ranks` (N of each MPI), `verifies` (the report of ranks, and what they say of damage), `exports` (pieces of several formats, and one `.vtkhdf`, by three ranks), `handover` (begun by one process and ended by ranks, and the
other way round), `launcher` (a program of one MPI under the launcher of another), `parallel`, `snakemake`, `slurm` (a Slurm of one node,
started here), `twice` (tasks in random order, each done twice, two at once). --mpi may be repeated: a program and the mpirun of the MPI it was
built with. A line of JSON for each result goes to FOLDER/results.jsonl; what is there already with the same program is not done again. What is
not installed is skipped, with --require a failure. Exit code 0 when all are alike.
"""
import argparse
import filecmp
import hashlib
import json
import os
import random
import shutil
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ENV = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMPI_MCA_rmaps_base_oversubscribe="1")
# Formats of which each rank writes pieces.
PIECES = ["a.vtu", "a.pvtu", "a.vtkhdf", "a.msh", "a.foam", "a.mfem", "a.mesh"]


class Differs(Exception):
    """What a carrier left is not what one process leaves."""


def run(words, **more):
    """What a command wrote to its standard output. Errors: it failed."""
    done = subprocess.run(words, capture_output=True, text=True, env=ENV, **more)
    if done.returncode:
        raise Differs(f"{' '.join(map(str, words))}: exit {done.returncode}\n{done.stdout[-500:]}{done.stderr[-1500:]}")
    return done.stdout


class Bench:
    def __init__(self, args):
        self.tetdb, self.folder = os.path.abspath(args.tetdb), os.path.abspath(args.folder)
        self.memory, self.tasks = args.memory, args.tasks
        self.mpis = [[os.path.abspath(p), shutil.which(m)] for p, _, m in (text.rpartition("=") for text in args.mpi)]
        os.makedirs(self.folder, exist_ok=True)

    def begin(self, job):
        """The store of one process, its digest, its exports in pieces."""
        self.job = job.split()
        self.one = self.store("one")
        run([self.tetdb, "mesh", *self.job, "-o", self.one, "-q", "--memory", "1GiB"])
        self.digest = run([self.tetdb, "digest", self.one]).strip()
        info = json.loads(run([self.tetdb, "info", self.one, "--json"]))
        self.tets, self.subdomains = info["tets"], len(info["subdomains"])

    def store(self, name):
        path = os.path.join(self.folder, f"{name}.tetdb")
        shutil.rmtree(path, ignore_errors=True)
        return path

    def check(self, store):
        found = run([self.tetdb, "digest", store]).strip()
        if found != self.digest:
            raise Differs(f"digest {found} instead of {self.digest}")
        if sorted(os.listdir(store)) != sorted(os.listdir(self.one)):
            raise Differs(f"files {sorted(os.listdir(store))} instead of {sorted(os.listdir(self.one))}")
        run([self.tetdb, "verify", store])
        shutil.rmtree(store)

    def mpirun(self, mpi, n, *words):
        program, launcher = mpi
        return run([launcher, "-n", str(n), program, *words], timeout=3600)

    def run_options(self):
        return ["--threads", "1", "--memory", self.memory, "-q"]

    def ranks(self, mpi, n):
        store = self.store("ranks")
        self.mpirun(mpi, n, "mesh", *self.job, "-o", store, *self.run_options())
        self.check(store)

    def verifies(self, mpi, n):
        """The report of so many ranks is that of one process, of a sound store and of a damaged one."""
        store = self.store("verified")
        shutil.copytree(self.one, store)
        words = ["verify", store, "--full", "--json"]
        for is_sound in (True, False):
            if not is_sound:
                damaged = max(f for f in os.listdir(store) if f.startswith("subdomain-"))
                with open(os.path.join(store, damaged), "r+b") as file:
                    # In many pages, for some hold nothing that is read.
                    for at in range(os.path.getsize(file.name) // 2, os.path.getsize(file.name) * 3 // 4, 4096):
                        file.seek(at)
                        file.write(64 * b"\xa5")
            alone, shared = (
                subprocess.run([*before, self.tetdb if not before else mpi[0], *words], capture_output=True, text=True, env=ENV, timeout=3600)
                for before in ([], [mpi[1], "-n", str(n)])
            )
            if (alone.returncode == 0) != is_sound or alone.stdout != shared.stdout or (shared.returncode == 0) != is_sound:
                raise Differs(f"verify: exit {alone.returncode} and {shared.returncode}\n{alone.stdout[-700:]}\n{shared.stdout[-700:]}{shared.stderr[-700:]}")
            if "one process" in shared.stderr:
                raise Differs(f"verify: {shared.stderr[-700:]}")
        shutil.rmtree(store)

    def exports(self, mpi, n):
        """Pieces by so many ranks have the bytes of those by one process."""
        alone, shared = (os.path.join(self.folder, name) for name in ("alone", "shared"))
        for folder in (alone, shared):
            shutil.rmtree(folder, ignore_errors=True)
            os.mkdir(folder)
        for name in PIECES:
            words = ["export", self.one, "-q", "--pieces"]
            run([self.tetdb, *words, os.path.join(alone, name)])
            self.mpirun(mpi, n, *words, os.path.join(shared, name))
        # One file that all ranks write, each its partitions.
        words = ["export", self.one, "-q"]
        run([self.tetdb, *words, os.path.join(alone, "one.vtkhdf")])
        self.mpirun(mpi, n, *words, os.path.join(shared, "one.vtkhdf"))
        alike(alone, shared)
        shutil.rmtree(alone)
        shutil.rmtree(shared)

    def handover(self, mpi):
        for first, second in ((1, 4), (4, 1)):
            store = self.store("handover")
            words = ["mesh", *self.job, "-o", store, "--coarse-only", *self.run_options()]
            self.mpirun(mpi, 4, *words) if first > 1 else run([self.tetdb, *words])
            words = ["resume", store, *self.run_options()]
            self.mpirun(mpi, 4, *words) if second > 1 else run([self.tetdb, *words])
            self.check(store)

    def launcher(self, mpi):
        """Under the launcher of each other MPI the program must say so and begin nothing; where there is no other, under what MPICH's sets."""
        store = self.store("launcher")
        words = [mpi[0], "mesh", *self.job, "-o", store, *self.run_options()]
        others = [[launcher, "-n", "4"] for program, launcher in self.mpis if program != mpi[0]]
        for other in others or [["env", "PMI_SIZE=4"]]:
            done = subprocess.run([*other, *words], capture_output=True, text=True, env=ENV, timeout=600)
            said = done.stdout + done.stderr
            if done.returncode == 0 or os.path.exists(store) or "has started 4 processes" not in said:
                raise Differs(f"started by {other}: exit {done.returncode}\n{said[-1000:]}")

    def coarse(self, name):
        store = self.store(name)
        run([self.tetdb, "mesh", *self.job, "-o", store, "--coarse-only", *self.run_options()])
        return store

    def script(self, store, engine):
        words = ["plan", store, "--tasks", str(self.tasks), f"--{engine}", "--memory-per-task", self.memory, "-q"]
        path = os.path.join(self.folder, f"{engine}.txt")
        with open(path, "w") as file:
            file.write(run([self.tetdb, *words]))
        return path

    def parallel(self):
        store = self.coarse("parallel")
        run(["sh", self.script(store, "parallel")], cwd=self.folder)
        self.check(store)

    def snakemake(self):
        store = self.coarse("snakemake")
        shutil.rmtree(os.path.join(self.folder, "snakemake.tasks"), ignore_errors=True)
        run([shutil.which("snakemake"), "-q", "-c2", "-s", self.script(store, "snakemake")], cwd=self.folder)
        self.check(store)

    def slurm(self):
        # Of its own, for munge's user has to come to it.
        slurm = run(["mktemp", "-d"]).strip()
        tool = os.path.join(HERE, "slurm-here.sh")
        try:
            subprocess.run([tool, "start", slurm], check=True, stdout=subprocess.DEVNULL)
            env = dict(ENV, SLURM_CONF=os.path.join(slurm, "slurm.conf"))
            store = self.coarse("slurm")
            subprocess.run(["sh", self.script(store, "slurm")], cwd=self.folder, env=env, check=True, stdout=subprocess.DEVNULL)
            while subprocess.run(["squeue", "-h"], env=env, capture_output=True).stdout:
                time.sleep(1)
            if "finished and verified" not in run([self.tetdb, "info", store]):
                raise Differs("the last job has not verified the store")
            self.check(store)
        finally:
            subprocess.run([tool, "stop", slurm], check=False)
            shutil.rmtree(slurm, ignore_errors=True)

    def twice(self):
        store = self.coarse("twice")
        local = os.path.join(self.folder, "local")
        os.makedirs(local, exist_ok=True)
        run([self.tetdb, "plan", store, "--tasks", str(self.tasks), "-q"])
        draw = random.Random(self.digest)
        while True:
            info = json.loads(run([self.tetdb, "info", store, "--json"]))
            tasks = 2 * [state["task"] for state in info["tasks"]["states"]]
            draw.shuffle(tasks)
            for two in (tasks[i : i + 2] for i in range(0, len(tasks), 2)):
                words = ["work", store, "--threads", "1", "--memory", self.memory, "-q"]
                children = [subprocess.Popen([self.tetdb, *words, "--task", str(t), "--scratch", local]) for t in two]
                if any([child.wait() for child in children]):
                    raise Differs(f"one of the tasks {two} failed")
            if json.loads(run([self.tetdb, "gather", store, "--json"]))["finished"]:
                break
        if os.listdir(local):
            raise Differs(f"tasks left {os.listdir(local)}")
        self.check(store)


def alike(a, b):
    both = filecmp.dircmp(a, b)
    differs = both.left_only + both.right_only + filecmp.cmpfiles(a, b, both.common_files, shallow=False)[1]
    if differs:
        raise Differs(f"exports: {differs}")
    for name in both.common_dirs:
        alike(os.path.join(a, name), os.path.join(b, name))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tetdb")
    parser.add_argument("folder")
    parser.add_argument("--mpi", action="append", default=[])
    parser.add_argument("--ranks", default="2,4")
    parser.add_argument("--job", action="append")
    parser.add_argument("--memory", default="96MiB")
    parser.add_argument("--tasks", type=int, default=3)
    parser.add_argument("--only")
    parser.add_argument("--require", action="store_true")
    args = parser.parse_args()
    bench, wrong, skipped = Bench(args), 0, []
    is_there = {
        "parallel": shutil.which("parallel"), "snakemake": shutil.which("snakemake"), "twice": True,
        "slurm": os.geteuid() == 0 and all(map(shutil.which, ["slurmctld", "slurmd", "munged", "sbatch"])),
    }
    carriers = []
    for mpi in bench.mpis:
        name = os.path.basename(mpi[1])
        carriers += [(f"ranks {n} {name}", lambda mpi=mpi, n=int(n): bench.ranks(mpi, n)) for n in args.ranks.split(",")]
        carriers.append((f"verifies {name}", lambda mpi=mpi: bench.verifies(mpi, 3)))
        carriers.append((f"exports {name}", lambda mpi=mpi: bench.exports(mpi, 3)))
        carriers.append((f"handover {name}", lambda mpi=mpi: bench.handover(mpi)))
        carriers.append((f"launcher {name}", lambda mpi=mpi: bench.launcher(mpi)))
    for name, found in is_there.items():
        if found:
            carriers.append((name, getattr(bench, name)))
        elif not args.only or name in args.only.split(","):
            skipped.append(name)
    if args.only:
        carriers = [c for c in carriers if c[0].split()[0] in args.only.split(",")]
    program = hashlib.sha256(open(bench.tetdb, "rb").read()).hexdigest()[:12]
    path, known = os.path.join(bench.folder, "results.jsonl"), set()
    if os.path.exists(path):
        results = map(json.loads, open(path))
        known = {(r["job"], r["carrier"]) for r in results if r["program"] == program and r["same"]}
    for job in args.job or ["sample:box,h=0.04 --subdomains 4"]:
        left = [c for c in carriers if (job, c[0]) not in known]
        if left:
            bench.begin(job)
        for name, carrier in left:
            begun, line = time.time(), {"job": job, "carrier": name, "program": program, "same": True}
            try:
                carrier()
            except (Differs, subprocess.SubprocessError) as error:
                wrong, line["same"], line["why"] = wrong + 1, False, str(error)
            line.update(tets=bench.tets, subdomains=bench.subdomains, digest=bench.digest, wall_s=round(time.time() - begun, 1))
            with open(path, "a") as file:
                print(json.dumps(line), file=file)
            print(json.dumps(line), flush=True)
        if left:
            shutil.rmtree(bench.one)
    for name in skipped:
        print(f"skipped: {name} is not installed")
    sys.exit(1 if wrong or (args.require and skipped) else 0)


if __name__ == "__main__":
    main()
