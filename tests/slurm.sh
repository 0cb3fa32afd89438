#!/usr/bin/env bash
# A real Slurm, of one node, makes the mesh of one process from the printed script: `slurm.sh PROGRAM FOLDER`.
set -euo pipefail
here=$(dirname "$(realpath "$0")")
program=$(realpath "$1")
mkdir -p "$2"
cd "$2"
# Of its own, for munge's user has to come to it.
slurm=$(mktemp -d)
trap '"$here/../tools/slurm-here.sh" stop "$slurm"; rm -rf "$slurm" || true' EXIT
"$here/../tools/slurm-here.sh" start "$slurm"
. "$slurm/env"
job=(sample:balls,count=40 --subdomains 6)
"$program" mesh "${job[@]}" -o one.tetdb --no-verify -q
"$program" mesh "${job[@]}" -o a.tetdb --coarse-only -q
"$program" plan a.tetdb --tasks 4 --slurm --memory-per-task 96MiB -q >run.sh
sh run.sh
for _ in $(seq 300); do
    [ -n "$(squeue -h)" ] || break
    sleep 1
done
[ "$("$program" digest a.tetdb)" = "$("$program" digest one.tetdb)" ] || { cat slurm-*.out; exit 1; }
diff <(ls a.tetdb) <(ls one.tetdb)
"$program" info a.tetdb | grep -q 'finished and verified'
echo "arrays of Slurm: the mesh of one process"
