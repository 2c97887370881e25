#!/bin/bash
# An experiment as a Slurm array:  sbatch --array=1-32 examples/ci/slurm.sh
# then, when all parts are done:   examples/ci/slurm.sh merge 32
# Arguments behind the script's name go to `posescope eval`, those of every part alike.
#
# A part that was killed, by its time limit say, goes on where it was when it is submitted again.
# For Slurm that is an array of its own, which has to be told the number of all parts:
#                                  PARTS=32 sbatch --array=7,12 examples/ci/slurm.sh
#SBATCH --job-name=posescope
#SBATCH --cpus-per-task=4
#SBATCH --mem=4G
#SBATCH --time=02:00:00
#SBATCH --requeue
set -euo pipefail

scene=${SCENE:-street}
experiment=${EXPERIMENT:-multi}
runs=${RUNS:-runs/$experiment}

if [ "${1:-}" = merge ]; then
    parts=()
    for part in $(seq "$2"); do parts+=("$runs/part-$part"); done
    exec posescope eval merge "${parts[@]}" --out "$runs/whole"
fi

exec posescope eval "$scene" --preset "$experiment" "$@" --quiet \
    --shard "$SLURM_ARRAY_TASK_ID/${PARTS:-$SLURM_ARRAY_TASK_COUNT}" \
    --threads "${SLURM_CPUS_PER_TASK:-1}" \
    --out "$runs/part-$SLURM_ARRAY_TASK_ID" --resume
