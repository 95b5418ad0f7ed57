#!/bin/bash
# Runs slurm.sbatch for real on this machine alone: a controller, a node and their munge are started for it, beside whatever runs, and
# stopped at the end. Begin in the folder that the example expects, as root; Debian: apt-get install slurm-wlm munge.
set -euo pipefail
example="$(cd "$(dirname "$0")" && pwd)/slurm.sbatch"
at="$(mktemp -d)"
started=()
trap 'kill "${started[@]}" 2>/dev/null || true; sleep 1; rm -rf "$at"' EXIT
chmod 755 "$at"
mkdir "$at/state" "$at/node"

head -c 128 /dev/urandom >"$at/key" && chmod 600 "$at/key"
munged --foreground --force --key-file="$at/key" --socket="$at/munge" --pid-file="$at/munged.pid" --log-file="$at/munged.log" \
  --seed-file="$at/seed" &
started+=($!)

export SLURM_CONF="$at/slurm.conf"
cat >"$SLURM_CONF" <<CONF
ClusterName=one
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmctldPort=46817
SlurmdPort=46818
AuthType=auth/munge
AuthInfo=socket=$at/munge
CredType=cred/munge
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmUser=root
SlurmctldPidFile=$at/slurmctld.pid
SlurmdPidFile=$at/slurmd.pid
SlurmdSpoolDir=$at/node
StateSaveLocation=$at/state
ReturnToService=2
NodeName=$(hostname -s) NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=$(($(awk '/MemTotal/ {print $2}' /proc/meminfo) / 1024 - 512))
PartitionName=all Nodes=ALL Default=YES State=UP
CONF
sleep 1
slurmctld -D -L "$at/slurmctld.log" & started+=($!)
slurmd -D -L "$at/slurmd.log" & started+=($!)
until sinfo --noheader 2>/dev/null | grep -q idle; do sleep 1; done

sbatch --wait "$example"
grep -il killed truegrind-*_*.log || true
truegrind gather corrected --csv corrected.csv --html corrected.html
