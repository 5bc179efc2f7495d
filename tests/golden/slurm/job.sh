#!/bin/bash
#SBATCH --job-name=relign-tiny
#SBATCH --array=0-3%2
#SBATCH --nodes=1
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=4
#SBATCH --mem=4G
#SBATCH --time=00:30:00
#SBATCH --signal=B:USR1@120
#SBATCH --requeue
#SBATCH --open-mode=append

# Written by relign-bench slurm script: task i of the array runs part i of the plan.
#   sbatch FILE                 all parts
#   sbatch --array=3,17 FILE    these parts again; relign-bench slurm status names them
# What has a complete record is not run again, so that sending a part twice does no harm.

shards=4    # the plan's, whatever the size of the array that is sent
requeues=5  # how often a part goes on after its time limit
command=(
  /PROGRAM run
  --plan /FOLDER/plan.json
  --out '/FOLDER/results/a b'
  --workers 4
)

shard=${SLURM_ARRAY_TASK_ID:?this is a Slurm job array: send it with sbatch}
time_is_up=
interrupted=

# Shortly before the time limit Slurm tells this shell alone. The program is asked to stop, and ends with 75.
on_notice() {
  interrupted=yes
  [ -z "$time_is_up" ] || return 0
  time_is_up=yes
  kill -TERM "$run" 2>/dev/null
  echo "relign-bench: the time limit is near; part $shard stops" >&2
}
trap on_notice USR1
# A cancelled task: Slurm tells the program too, whose end is waited for.
trap 'interrupted=yes' TERM

"${command[@]}" --shard "$shard/$shards" &
run=$!
while
  interrupted=
  wait "$run"
  status=$?
  [ -n "$interrupted" ]
do
  :
done

if [ "$status" -eq 75 ] && [ -n "$time_is_up" ]; then
  # Slurm ends this task, scontrol too, as soon as it has taken the request: the answer must still be heard.
  trap '' TERM
  if [ "${SLURM_RESTART_COUNT:-0}" -lt "$requeues" ] &&
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}"; then
    echo "relign-bench: part $shard goes on when Slurm starts it again" >&2
  else
    echo "relign-bench: part $shard is not complete; send it again: sbatch --array=$shard" >&2
  fi
fi
exit "$status"
