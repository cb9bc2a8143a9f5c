#!/usr/bin/env bash
# One chunk of a restore, render or sweep, as a task of a Slurm array. A task that is killed is run again by itself
# (--requeue) or by submitting the same line once more: what is done is left as it is.
# Usage: sbatch --array=1-40 slurm_chunks.sh 40 restore MODEL.fil --poses POSES -o SHOT.pc2
#        sbatch --array=1-40 slurm_chunks.sh 40 render MODEL.fil --poses POSES... -o frame_%04d.png
#        sbatch --array=1-40 slurm_chunks.sh 40 sweep SCENE.toml --set body.young_modulus=1e4,1e5 -o TABLE.csv
#SBATCH --job-name=filigree
#SBATCH --cpus-per-task=2
#SBATCH --requeue
set -euo pipefail
chunks=$1
shift
exec "${FILIGREE:-filigree}" "$@" --quiet --threads "${SLURM_CPUS_PER_TASK:-1}" --chunk "$SLURM_ARRAY_TASK_ID/$chunks"
