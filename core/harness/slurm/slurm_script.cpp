#include "slurm/slurm_script.h"

#include <algorithm>
#include <cctype>

#include "base/error.h"
#include "base/shell_words.h"
#include "base/text.h"

namespace relign::cli {
namespace {

// Slurm signals this many seconds before the time limit; the running steps should end within them.
constexpr const char* kNotice = "120";

// The program runs in the background, because bash handles signals only between commands and in `wait`. A signal ends
// `wait` with a status that is not the program's, so the script waits again.
constexpr const char* kBody = R"(
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
)";

std::string quoted(const std::filesystem::path& path) {
  const std::string text = path.string();
  if (std::any_of(text.begin(), text.end(),
                  [](char letter) { return std::iscntrl(static_cast<unsigned char>(letter)); }))
    throw Error(ErrorKind::bad_input, "'" + text +
                                          "' contains a control character, such as a newline, which a batch script " +
                                          "cannot contain; rename the file or folder");
  return shell_quoted(text);
}

// For lines that sbatch reads, which have no reliable quoting.
std::string plain_name(std::string name) {
  for (char& letter : name) {
    const bool plain = std::isalnum(static_cast<unsigned char>(letter)) || letter == '-' || letter == '.';
    if (!plain) letter = '_';
  }
  return name.substr(0, 60);
}

}  // namespace

std::string slurm_array(const std::vector<unsigned>& indices) {
  std::vector<std::string> ranges;
  for (std::size_t begin = 0, end = 0; begin < indices.size(); begin = end) {
    end = begin + 1;
    while (end < indices.size() && indices[end] == indices[end - 1] + 1) ++end;
    const std::string first = std::to_string(indices[begin]), last = std::to_string(indices[end - 1]);
    ranges.push_back(end - begin == 1 ? first : first + (end - begin == 2 ? "," : "-") + last);
  }
  return join(ranges, ",");
}

std::string slurm_script_text(const SlurmScript& script) {
  std::string array = script.shards == 1 ? "0" : "0-" + std::to_string(script.shards - 1);
  if (script.max_parallel > 0) array += "%" + std::to_string(script.max_parallel);
  std::string text = "#!/bin/bash\n";
  const auto directive = [&text](const std::string& option) { text += "#SBATCH --" + option + "\n"; };
  directive("job-name=relign-" + plain_name(script.name));
  directive("array=" + array);
  directive("nodes=1");
  directive("ntasks=1");
  directive("cpus-per-task=" + std::to_string(script.cpus));
  if (!script.memory.empty()) directive("mem=" + script.memory);
  directive("time=" + script.time);
  directive(std::string("signal=B:USR1@") + kNotice);
  directive("requeue");
  directive("open-mode=append");
  text +=
      "\n# Written by relign-bench slurm script: task i of the array runs shard i of the plan.\n"
      "#   sbatch FILE                 all shards\n"
      "#   sbatch --array=3,17 FILE    these shards again; relign-bench slurm status lists them\n"
      "# Trials with a complete record are not run again, so that submitting a shard twice does no harm.\n\n";
  text += "shards=" + std::to_string(script.shards) + "    # of the plan, whatever the size of the submitted array\n";
  text += "requeues=" + std::to_string(script.requeues) + "  # how often a shard is requeued after its time limit\n";
  text += "command=(\n  " + quoted(script.program) + " run\n  --plan " + quoted(script.plan) + "\n  --out " +
          quoted(script.results) + "\n  --workers " + std::to_string(script.cpus) + "\n";
  if (script.sandbox) text += "  --sandbox\n";
  for (const std::filesystem::path& plugin : script.plugins) text += "  --plugin " + quoted(plugin) + "\n";
  return text + ")\n" + kBody;
}

}  // namespace relign::cli
