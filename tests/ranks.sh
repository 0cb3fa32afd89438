#!/usr/bin/env bash
# Ranks of MPI make the mesh of one process: `ranks.sh PROGRAM_WITH_MPI PROGRAM FOLDER`.
# Then one of them is killed, and the same ranks go on.
set -euo pipefail
with=$(realpath "$1") plain=$(realpath "$2")
mkdir -p "$3"
cd "$3"
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
ranks() { timeout 600 ${MPIRUN:-mpirun} -n "$1" "$with" "${@:2}" --threads 1 --memory 96MiB -q; }
same() {
    [ "$("$plain" digest "$1")" = "$digest" ] || { echo "$1: another mesh"; exit 1; }
    diff <(ls "$1") <(ls one.tetdb) || { echo "$1: other files"; exit 1; }
    echo "$1: the mesh of one process"
}

job=(sample:balls,count=40 --subdomains 6)
"$plain" mesh "${job[@]}" -o one.tetdb -q
digest=$("$plain" digest one.tetdb)
for n in 1 2 4; do
    ranks $n mesh "${job[@]}" -o "$n.tetdb"
    same "$n.tetdb"
done
# Begun by one process, ended by four; begun by four, ended by one.
"$plain" mesh "${job[@]}" -o begun.tetdb --coarse-only -q
ranks 4 resume begun.tetdb
same begun.tetdb
ranks 4 mesh "${job[@]}" -o stopped.tetdb --coarse-only
"$plain" resume stopped.tetdb -q
same stopped.tetdb

killed=0
for wait in 0.3 0.6 0.9 1.2; do
    rm -rf killed.tetdb
    ranks 4 mesh "${job[@]}" -o killed.tetdb --no-verify 2>/dev/null &
    while [ ! -e killed.tetdb/catalog.redb ]; do sleep 0.02; done
    sleep $wait
    # One of the ranks of this folder, whichever comes first.
    for process in /proc/[0-9]*; do
        if [ "$(readlink "$process/exe")" = "$with" ] && [ "$(readlink "$process/cwd")" = "$PWD" ]; then
            kill -9 "${process#/proc/}" && killed=$((killed + 1))
            break
        fi
    done 2>/dev/null
    wait $! || true
    ranks 4 resume killed.tetdb
    same killed.tetdb
done
[ $killed -gt 0 ] || { echo "no rank could be killed"; exit 1; }

# The launcher of another MPI: the program alone would begin the same store several times.
if PMI_SIZE=4 "$with" info one.tetdb 2>refused; then
    echo "a launcher of another MPI is not noticed"
    exit 1
fi
grep -q "has started 4 processes" refused
