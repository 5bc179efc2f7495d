// relign-bench slurm script: prints a batch script that runs a plan as a job array.
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "cli/app.h"
#include "runner/frozen_plan.h"
#include "slurm/slurm_script.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

// Slurm's default MaxArraySize, which is the largest index + 1.
constexpr unsigned kUsualArraySize = 1001;

struct ScriptArguments {
  std::string plan, out, memory;
  std::string time = "01:00:00";
  unsigned max_parallel = 0, cpus = 1, requeues = 5;
};

bool all_digits(const std::string& text, std::size_t least, std::size_t most) {
  return text.size() >= least && text.size() <= most && text.find_first_not_of("0123456789") == std::string::npos;
}

// Parses HH:MM:SS or D-HH:MM:SS; seconds, or -1 for anything else.
long seconds_of(const std::string& time) {
  const std::size_t dash = time.find('-');
  const std::string days = dash == std::string::npos ? "0" : time.substr(0, dash);
  const std::string clock = dash == std::string::npos ? time : time.substr(dash + 1);
  const std::size_t minutes = clock.find(':'), seconds = clock.rfind(':');
  if (minutes == std::string::npos || seconds == minutes) return -1;
  const std::string h = clock.substr(0, minutes), m = clock.substr(minutes + 1, seconds - minutes - 1),
                    s = clock.substr(seconds + 1);
  if (!all_digits(days, 1, 3) || !all_digits(h, 1, 3) || !all_digits(m, 2, 2) || !all_digits(s, 2, 2)) return -1;
  return ((std::stol(days) * 24 + std::stol(h)) * 60 + std::stol(m)) * 60 + std::stol(s);
}

CLI::Validator time_limit() {
  return CLI::Validator(
      [](const std::string& text) {
        const long seconds = seconds_of(text);
        if (seconds < 0) return "'" + text + "' is not of the form HH:MM:SS or D-HH:MM:SS";
        // Slurm signals two minutes before the limit.
        return seconds < 300
                   ? "'" + text +
                         "' is too short; allowed: 00:05:00 or longer, the last two minutes of which are for stopping"
                   : std::string();
      },
      "");
}

CLI::Validator memory_size() {
  return CLI::Validator(
      [](const std::string& text) {
        const bool unit = !text.empty() && std::string("KMGT").find(text.back()) != std::string::npos;
        return all_digits(text.substr(0, text.size() - (unit ? 1 : 0)), 1, 12)
                   ? std::string()
                   : "'" + text + "' is not a memory size; expected, for example, 4G or 500M";
      },
      "");
}

int print_script(Context& context, const ScriptArguments& arguments) {
  const runner::FrozenPlan plan = runner::read_plan(arguments.plan);
  const auto absolute = [](const fs::path& path) { return fs::absolute(path).lexically_normal(); };
  SlurmScript script;
  script.name = plan.name;
  script.shards = plan.shards;
  script.sandbox = plan.sandbox;
  script.program = fs::read_symlink("/proc/self/exe");
  script.plan = absolute(arguments.plan);
  script.results = absolute(arguments.out.empty() ? fs::path("results") / plan.name : fs::path(arguments.out));
  for (const std::string& plugin : context.plugin_paths) script.plugins.push_back(absolute(plugin));
  script.cpus = arguments.cpus;
  script.max_parallel = arguments.max_parallel;
  script.time = arguments.time;
  script.memory = arguments.memory;
  script.requeues = arguments.requeues;
  const std::string text = slurm_script_text(script);
  if (plan.shards >= kUsualArraySize)
    print_warning("the plan has " + std::to_string(plan.shards) +
                  " shards, more than Slurm's default limit of an array, " + std::to_string(kUsualArraySize - 1) +
                  "; check your cluster's with 'scontrol show config | grep MaxArraySize', or plan fewer --shards");
  if (context.json) {
    const Json result = {
        {"script", text}, {"name", plan.name}, {"shards", plan.shards}, {"results", script.results.string()}};
    print_result(result.dump(2) + "\n");
    return kDone;
  }
  print_result(text);
  // Only if the script is redirected to a file: on a terminal it would obscure the script.
  if (isatty(STDOUT_FILENO) == 0)
    std::fprintf(stderr,
                 "Next: sbatch FILE (with -p and -A as your cluster requires), and later\n"
                 "  %s%s\n",
                 own_command("slurm status --plan " + shell_quoted(arguments.plan)).c_str(),
                 arguments.out.empty() ? "" : (" -o " + shell_quoted(arguments.out)).c_str());
  return kDone;
}

}  // namespace

void add_slurm(CLI::App& app, Context& context) {
  CLI::App& slurm = add_verb(app, {"slurm", "Run a plan on a Slurm cluster.",
                                   "relign-bench slurm script --plan plan.json > job.sh", "plan, run, merge"});
  slurm.require_subcommand(1);
  CLI::App& verb = add_verb(slurm, {"script", "Print a batch script that runs a plan's shards as a job array.",
                                    "relign-bench plan suites/quick.json -o plan.json --shards 40\n"
                                    "relign-bench slurm script --plan plan.json --cpus 4 --max-parallel 10 > job.sh\n"
                                    "sbatch job.sh",
                                    "slurm status, plan, run, merge"});
  ScriptArguments& arguments = add_action(verb, context, print_script);
  verb.add_option("--plan", arguments.plan, "plan file, written by 'relign-bench plan'; it sets the number of shards")
      ->required()
      ->type_name("FILE");
  verb.add_option("-o,--out", arguments.out,
                  "results folder, visible to all nodes [default: results/NAME, with the suite's name]")
      ->type_name("DIR");
  verb.add_option("--max-parallel", arguments.max_parallel,
                  "number of shards to run in parallel [default: as many as Slurm starts]")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, 1000000U));
  verb.add_option("--time", arguments.time,
                  "time limit of a shard, HH:MM:SS or D-HH:MM:SS, at least 00:05:00; a shard stops two minutes before "
                  "it, resumable")
      ->type_name("TIME")
      ->check(time_limit())
      ->capture_default_str();
  verb.add_option("--cpus", arguments.cpus, "cores per shard, each of which runs one trial at a time")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, 1024U))
      ->capture_default_str();
  verb.add_option("--mem", arguments.memory, "memory per shard, such as 4G [default: the cluster's]")
      ->type_name("SIZE")
      ->check(memory_size());
  verb.add_option("--requeues", arguments.requeues, "automatic requeues of a shard that reached its time limit")
      ->type_name("COUNT")
      ->check(CLI::Range(0U, 1000U))
      ->capture_default_str();
  add_slurm_status(slurm, context);
}

}  // namespace relign::cli
