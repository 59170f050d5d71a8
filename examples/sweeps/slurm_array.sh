#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
#
# A sweep by an array of Slurm's: each task does a part of the runs, on whatever node it gets.
#
#   stage sweep room.world --set bots=10,100 --runs 0:1000 --plan-only -o /shared/out    # once
#   sbatch --array=1-16 slurm_array.sh /shared/out
#
# Tasks that were killed, or reached their time limit, go on when the second line is given again.
# The folder has to be one that all nodes see.

#SBATCH --job-name=stage-sweep
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=2
#SBATCH --time=01:00:00

set -euo pipefail
folder=$1
first=${SLURM_ARRAY_TASK_MIN:-1} # an array may begin at 0
exec "${STAGE:-stage}" sweep --resume "$folder" --no-progress \
  --shard "$((SLURM_ARRAY_TASK_ID - first + 1))/$SLURM_ARRAY_TASK_COUNT" --jobs "${SLURM_CPUS_PER_TASK:-1}"
