#!/usr/bin/env bash
# Restores a shot on a Slurm cluster, a chunk of its frames a task. A task that is killed is run again by itself
# (--requeue) or by submitting the same line once more: chunks that are done are left as they are.
# Usage: sbatch --array=1-40 slurm_restore.sh MODEL.fil POSES SHOT.pc2 40
#SBATCH --job-name=filigree
#SBATCH --cpus-per-task=2
#SBATCH --requeue
set -euo pipefail
model=$1 poses=$2 shot=$3 chunks=$4
exec "${FILIGREE:-filigree}" restore "$model" --poses "$poses" -o "$shot" --quiet \
    --threads "${SLURM_CPUS_PER_TASK:-1}" --chunk "$SLURM_ARRAY_TASK_ID/$chunks"
