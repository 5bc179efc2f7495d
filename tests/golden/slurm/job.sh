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

# Written by relign-bench slurm script: task i of the array runs shard i of the plan.
#   sbatch FILE                 all shards
#   sbatch --array=3,17 FILE    these shards again; relign-bench slurm status lists them
# Trials with a complete record are not run again, so that submitting a shard twice does no harm.

shards=4    # of the plan, whatever the size of the submitted array
requeues=5  # how often a shard is requeued after its time limit
command=(
  /PROGRAM run
  --plan /FOLDER/plan.json
  --out '/FOLDER/results/a b'
  --workers 4
)

shard=${SLURM_ARRAY_TASK_ID:?this script is a Slurm job array; submit it with sbatch}
time_is_up=
interrupted=

# Shortly before the time limit Slurm signals only this shell, which asks the program to stop; it exits with 75.
on_notice() {
  interrupted=yes
  [ -z "$time_is_up" ] || return 0
  time_is_up=yes
  kill -TERM "$run" 2>/dev/null
  echo "relign-bench: the time limit is near; shard $shard stops" >&2
}
trap on_notice USR1
# A cancelled task: Slurm also signals the program; this shell waits for it to end.
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
  # Slurm ends this task, including scontrol, as soon as it accepts the request; the shell must outlive that.
  trap '' TERM
  if [ "${SLURM_RESTART_COUNT:-0}" -lt "$requeues" ] &&
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_${SLURM_ARRAY_TASK_ID}"; then
    echo "relign-bench: shard $shard resumes when Slurm starts it again" >&2
  else
    echo "relign-bench: shard $shard is not complete; resubmit it with sbatch --array=$shard" >&2
  fi
fi
exit "$status"
