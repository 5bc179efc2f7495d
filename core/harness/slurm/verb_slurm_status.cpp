// relign-bench slurm status: shows which shards of a plan must be resubmitted.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "cli/app.h"
#include "cli/text_table.h"
#include "runner/shard_status.h"
#include "slurm/slurm_script.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;
using runner::ShardState;
using runner::ShardStatus;

struct StatusArguments {
  std::string plan, out;
};

std::vector<unsigned> numbers_of(const std::vector<ShardStatus>& shards, ShardState state) {
  std::vector<unsigned> numbers;
  for (unsigned number = 0; number < shards.size(); ++number)
    if (shards[number].state() == state) numbers.push_back(number);
  return numbers;
}

std::vector<unsigned> incomplete(const std::vector<ShardStatus>& shards) {
  std::vector<unsigned> numbers;
  for (unsigned number = 0; number < shards.size(); ++number)
    if (shards[number].state() != ShardState::complete) numbers.push_back(number);
  return numbers;
}

std::size_t done_trials(const std::vector<ShardStatus>& shards) {
  std::size_t done = 0;
  for (const ShardStatus& shard : shards) done += shard.done;
  return done;
}

Json status_json(const runner::FrozenPlan& plan, const std::vector<ShardStatus>& shards, const fs::path& results) {
  Json parts = Json::array();
  for (unsigned number = 0; number < shards.size(); ++number)
    parts.push_back({{"shard", number},
                     {"state", to_string(shards[number].state())},
                     {"trials", shards[number].trials},
                     {"done", shards[number].done},
                     {"attempts", shards[number].attempts}});
  return {{"plan", plan.hash},
          {"results", results.string()},
          {"shards", shards.size()},
          {"complete", numbers_of(shards, ShardState::complete).size()},
          {"trials", plan.trials},
          {"done", done_trials(shards)},
          {"array", slurm_array(incomplete(shards))},
          {"parts", std::move(parts)}};
}

std::string status_text(const runner::FrozenPlan& plan, const std::vector<ShardStatus>& shards) {
  std::string text;
  for (const ShardState state : {ShardState::complete, ShardState::partly, ShardState::missing}) {
    const std::vector<unsigned> numbers = numbers_of(shards, state);
    std::string name = to_string(state);
    text += name + std::string(10 - name.size(), ' ') + std::to_string(numbers.size()) +
            (numbers.empty() ? "" : ": " + slurm_array(numbers)) + "\n";
  }
  text += "trials    " + std::to_string(done_trials(shards)) + " of " + std::to_string(plan.trials) + "\n";
  const std::vector<unsigned> again = incomplete(shards);
  if (again.empty()) return text;

  constexpr std::size_t kShown = 40;
  TextTable table({"shard", "state", "trials", "of", "attempts"});
  for (std::size_t i = 0; i < again.size() && i < kShown; ++i) {
    const ShardStatus& shard = shards[again[i]];
    table.add({std::to_string(again[i]), to_string(shard.state()), std::to_string(shard.done),
               std::to_string(shard.trials), std::to_string(shard.attempts.size())});
  }
  text += "\n" + table.text();
  if (again.size() > kShown) text += "... and " + std::to_string(again.size() - kShown) + " more; --json lists all\n";
  return text + "\n--array=" + slurm_array(again) + "\n";
}

int print_status(Context& context, const StatusArguments& arguments) {
  const runner::FrozenPlan plan = runner::read_plan(arguments.plan);
  const fs::path results = arguments.out.empty() ? fs::path("results") / plan.name : fs::path(arguments.out);
  const std::vector<ShardStatus> shards =
      runner::status_of_shards(plan, results, [](const std::string& note) { print_warning(note); });
  const bool complete = incomplete(shards).empty();
  if (context.json) {
    print_result(status_json(plan, shards, results).dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
    return complete ? kDone : kStopped;
  }
  print_text(status_text(plan, shards));
  if (complete)
    std::fprintf(stderr, "Next: %s\n", own_command("merge " + shell_quoted(results.string()) + " -o DIR").c_str());
  else
    std::fputs(
        "Shards that squeue still lists are running. Resubmit the others with the same script:\n"
        "  sbatch --array=... FILE\n",
        stderr);
  return complete ? kDone : kStopped;
}

}  // namespace

void add_slurm_status(CLI::App& slurm, Context& context) {
  CLI::App& verb = add_verb(
      slurm,
      {"status",
       "Show which shards of a plan are complete and which to resubmit. Exit code 0 if all are complete, else 75.",
       "relign-bench slurm status --plan plan.json\n"
       "sbatch $(relign-bench slurm status --plan plan.json | grep ^--array=) job.sh",
       "slurm script, run, merge"});
  StatusArguments& arguments = add_action(verb, context, print_status);
  verb.add_option("--plan", arguments.plan, "plan file, written by 'relign-bench plan'")->required()->type_name("FILE");
  verb.add_option("-o,--out", arguments.out,
                  "results folder with the shards [default: results/NAME, with the suite's name]")
      ->type_name("DIR");
}

}  // namespace relign::cli
