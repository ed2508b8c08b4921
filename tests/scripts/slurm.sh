#!/usr/bin/env bash
# Runs a command beside a Slurm of its own: slurm.sh COMMAND …
#
# One node, this machine, with as many tasks at once as it has cores; everything in a temporary
# folder, gone with the command. The command finds the cluster by SLURM_CONF. Needs Debian's packages
# slurmctld, slurmd, slurm-client and munge, and root, as slurmd does.
set -euo pipefail

for program in slurmctld slurmd munged sbatch squeue; do
    PATH="$PATH:/usr/sbin" command -v "$program" >/dev/null || {
        echo "slurm.sh: $program is missing; install slurmctld slurmd slurm-client munge" >&2
        exit 2
    }
done
((EUID == 0)) || { echo "slurm.sh: slurmd needs root" >&2; exit 2; }
PATH="$PATH:/usr/sbin"

# Sockets have short paths.
home=$(mktemp -d /tmp/slurm.XXXXXX)
daemons=()
stop() {
    local status=$? pid
    set +e
    scancel --state=PENDING >/dev/null 2>&1
    scancel --state=RUNNING >/dev/null 2>&1
    for pid in "${daemons[@]}"; do kill "$pid" 2>/dev/null; done
    for pid in "${daemons[@]}"; do wait "$pid" 2>/dev/null; done
    # For those who ask why it did not start.
    if ((status != 0)) && [[ -n ${SLURM_LOGS:-} ]]; then cp "$home"/*.log "$SLURM_LOGS" 2>/dev/null; fi
    rm -rf "$home"
    exit "$status"
}
trap stop EXIT
trap 'exit 143' TERM
trap 'exit 130' INT

mkdir -p "$home"/{state,spool}
chmod 755 "$home"
(umask 077 && head -c 1024 /dev/urandom >"$home/munge.key")
host=$(hostname -s)
memory=$(awk '/^MemTotal:/ { print int($2 / 1024 * 0.9) }' /proc/meminfo)
# A port without a listener.
free_port() {
    local port
    while :; do
        port=$((20000 + RANDOM % 20000))
        (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || { echo "$port"; return; }
    done
}
cat >"$home/slurm.conf" <<CONF
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$home/munge.socket
CryptoType=crypto/munge
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
StateSaveLocation=$home/state
SlurmdSpoolDir=$home/spool
SlurmctldPidFile=$home/slurmctld.pid
SlurmdPidFile=$home/slurmd.pid
SlurmctldLogFile=$home/slurmctld.log
SlurmdLogFile=$home/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
DefMemPerCPU=500
MpiDefault=none
ReturnToService=2
KillWait=5
MinJobAge=300
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$memory State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$home/slurm.conf

munged --foreground --force --key-file="$home/munge.key" --socket="$home/munge.socket" \
    --pid-file="$home/munged.pid" --seed-file="$home/munged.seed" \
    --log-file="$home/munged.log" 2>"$home/munged.err.log" &
daemons+=($!)
for _ in {1..100}; do [[ -S $home/munge.socket ]] && break; sleep 0.1; done
slurmctld -D -i 2>"$home/slurmctld.err.log" >&2 &
daemons+=($!)
slurmd -D 2>"$home/slurmd.err.log" >&2 &
daemons+=($!)
for _ in {1..300}; do
    [[ $(sinfo -h -o %t 2>/dev/null) == idle ]] && break
    sleep 0.1
done
[[ $(sinfo -h -o %t 2>/dev/null) == idle ]] || {
    echo "slurm.sh: the node does not come up:" >&2
    tail -n 5 "$home"/*.log >&2
    exit 1
}
"$@"
