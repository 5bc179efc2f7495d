// relign-bench plan: freezes a suite's trials in a file, divided into shards for several machines.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/files.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "cli/app.h"
#include "cli/interrupt.h"
#include "cli/shared_files.h"
#include "runner/frozen_plan.h"
#include "runner/shard_attempt.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct PlanArguments {
  std::string suite;
  std::string out;
  unsigned shards = 1;
};

// Only an earlier plan may be overwritten.
void refuse_other_files(const fs::path& file) {
  std::error_code code;
  if (!fs::exists(file, code)) return;
  const Json content = parsed_json(read_file(file));
  if (!content.is_object() || !content.contains("blocks") || !content.contains("plan"))
    throw Error(ErrorKind::bad_input, "--out: '" + file.string() + "' exists and is not a plan; choose another file");
}

int make_plan(Context& context, const PlanArguments& arguments) {
  refuse_other_files(arguments.out);
  context.start_sandbox("");
  suites::Suite suite = suites::read_suite(suite_file(arguments.suite), context.catalog());
  const runner::PreparedPlan prepared = runner::prepare(
      std::move(suite), cache_folder(), [](const std::string& note) { print_warning(note); }, &watch_for_stop(),
      context.sandbox());
  const fs::path folder = fs::absolute(arguments.out).parent_path();
  const runner::FrozenPlan plan = runner::freeze(prepared, arguments.shards, folder, context.sandboxed);
  write_file_atomically(arguments.out, json_of(plan).dump(1) + "\n");

  const std::string last = std::to_string(arguments.shards - 1) + "/" + std::to_string(arguments.shards);
  const std::string results = "results/" + prepared.plan.suite.name;
  // 'merge' would take a finished run there for the only source.
  const bool taken = fs::exists(fs::path(results) / "manifest.json");
  const std::string shards = taken ? results + "-shards" : results;
  if (context.json) {
    const Json result = {{"plan", arguments.out},
                         {"hash", plan.hash},
                         {"trials", prepared.plan.trials.size()},
                         {"shards", arguments.shards}};
    print_result(result.dump(2) + "\n");
    return kDone;
  }
  print_result("plan     " + arguments.out + "\ntrials   " + std::to_string(prepared.plan.trials.size()) +
               "\nshards   " + std::to_string(arguments.shards) + ", of " +
               std::to_string(runner::places_of_shard(prepared.plan, arguments.shards - 1, arguments.shards).size()) +
               " to " + std::to_string(runner::places_of_shard(prepared.plan, 0, arguments.shards).size()) +
               " trials\n");
  std::fprintf(stderr,
               "Next: run every shard, in any order and on any machine that can read these files, then merge:\n"
               "  %s --shard 0/%u%s%s%s\n  %s\n",
               own_command("run --plan " + shell_quoted(arguments.out)).c_str(), arguments.shards,
               taken ? (" -o " + shell_quoted(shards)).c_str() : "", context.sandboxed ? " --sandbox" : "",
               arguments.shards > 1 ? ("   ... " + last).c_str() : "",
               own_command("merge " + shell_quoted(shards) + " -o " + shell_quoted(results + "-merged")).c_str());
  return kDone;
}

}  // namespace

void add_plan(CLI::App& app, Context& context) {
  CLI::App& verb =
      add_verb(app, {"plan", "Freeze a suite's trials in a plan and divide it into shards for several machines.",
                     "relign-bench plan suites/quick.json -o plan.json --shards 4\n"
                     "relign-bench run --plan plan.json --shard 0/4   # ... to 3/4\n"
                     "relign-bench merge results/quick -o results/quick-merged",
                     "run, merge, validate"});
  PlanArguments& arguments = add_action(verb, context, make_plan, "Stopped; no plan was written.");
  arguments.out = "plan.json";
  verb.add_option("SUITE", arguments.suite, kSuiteHelp)->required()->type_name("SUITE");
  verb.add_option("-o,--out", arguments.out, "plan file; plugins and data files are not copied into it")
      ->type_name("FILE")
      ->capture_default_str();
  verb.add_option("--shards", arguments.shards,
                  "number of shards of about equal work; aim for five to ten minutes each")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, 1000000U))
      ->capture_default_str();
  add_sandbox_options(verb, context);
}

}  // namespace relign::cli
