#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
#
# A sweep as a Slurm job array: each task executes a part of the runs, on any node.
#
#   stage sweep room.world --set bots=10,100 --runs 0:1000 --plan-only -o /shared/out    # once
#   sbatch --array=1-16 slurm_array.sh /shared/out
#
# Run the second line again to continue after tasks were killed or reached their time limit.
# All nodes must see the folder.

#SBATCH --job-name=stage-sweep
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=2
#SBATCH --time=01:00:00

set -euo pipefail
folder=$1
first=${SLURM_ARRAY_TASK_MIN:-1} # the first index of an array may be 0
exec "${STAGE:-stage}" sweep --resume "$folder" --no-progress \
  --shard "$((SLURM_ARRAY_TASK_ID - first + 1))/$SLURM_ARRAY_TASK_COUNT" --jobs "${SLURM_CPUS_PER_TASK:-1}"
