#!/usr/bin/env bash
# A Slurm of one node on this machine, for tests: `slurm-here.sh start FOLDER`, then `. FOLDER/env`, then `slurm-here.sh stop FOLDER`.
# Needs slurmctld, slurmd, munge and slurm-client (Debian packages of these names), and root. Listens on this machine alone.
set -euo pipefail
what=$1
mkdir -p "$2"
dir=$(realpath "$2")
case $what in
start)
    host=$(hostname -s)
    mkdir -p "$dir/state" "$dir/spool" "$dir/munge"
    chown munge: "$dir/munge" && chmod 755 "$dir/munge" "$dir"
    head -c 1024 /dev/urandom >"$dir/munge/key"
    chown munge: "$dir/munge/key" && chmod 400 "$dir/munge/key"
    su -s /bin/sh munge -c "munged --key-file=$dir/munge/key --socket=$dir/munge/socket --pid-file=$dir/munge/pid \
        --log-file=$dir/munge/log --seed-file=$dir/munge/seed --force"
    cat >"$dir/slurm.conf" <<CONF
ClusterName=here
SlurmctldHost=$host(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket=$dir/munge/socket
CredType=cred/munge
SlurmUser=root
SlurmctldPort=16817
SlurmdPort=16818
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
MpiDefault=none
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$(awk '/MemTotal/ { print int($2 / 1024) }' /proc/meminfo) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
    echo "export SLURM_CONF=$dir/slurm.conf" >"$dir/env"
    export SLURM_CONF=$dir/slurm.conf
    slurmctld
    slurmd
    for _ in $(seq 60); do
        [ "$(sinfo -h -o %t 2>/dev/null)" = idle ] && exit 0
        sleep 0.5
    done
    echo "the node does not come up; see $dir/slurmctld.log and $dir/slurmd.log"
    exit 1
    ;;
stop)
    for pid in "$dir/slurmd.pid" "$dir/slurmctld.pid" "$dir/munge/pid"; do
        [ ! -f "$pid" ] || kill "$(cat "$pid")" || true
    done
    ;;
*)
    echo "start or stop" >&2
    exit 2
    ;;
esac
