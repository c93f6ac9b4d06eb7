#!/bin/sh
#SBATCH --job-name=avastra
#SBATCH --array=1-64
#SBATCH --cpus-per-task=1
#SBATCH --mem=1G
#SBATCH --time=08:00:00
#SBATCH --requeue
# A study in 64 shards, each in a folder of its own below shards/, on a file system that all nodes see.
#
#   sbatch examples/cluster/slurm.sh
#   sbatch --array="$(avastra merge shards/* --missing)" examples/cluster/slurm.sh     # the killed ones again
#   avastra merge shards/* --out runs/rq1
set -eu
# The number of all shards, also when only some are played again.
SHARDS=64
out="shards/$SLURM_ARRAY_TASK_ID"
if [ -f "$out/study.yaml" ]; then
  # A task that was killed goes on where it was.
  avastra study --resume "$out" --jobs 1
else
  avastra study scenarios/studies/rq1.yaml --shard "$SLURM_ARRAY_TASK_ID/$SHARDS" --out "$out" --jobs 1
fi
