// relign-bench run: runs a suite, or resumes it, and writes the report.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/expected_time.h"
#include "cli/interrupt.h"
#include "cli/plan_check.h"
#include "cli/progress.h"
#include "cli/secrets.h"
#include "cli/shard_job.h"
#include "cli/shared_files.h"
#include "records/results_folder.h"
#include "report/report.h"
#include "runner/run.h"
#include "runner/worker.h"
#include "suites/suite.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct RunArguments {
  std::string suite;
  std::string out;
  unsigned workers = 0;
  std::vector<std::string> only;
  std::string isolation = "process";
  bool retry_failed = false, drop_damaged = false;
  std::string plan, shard, secret;
};

std::vector<std::pair<std::string, std::string>> parse_only(const std::vector<std::string>& only) {
  const std::vector<std::string> keys = {"scene", "noise_level", "algorithm", "protocol", "instance"};
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const std::string& text : only) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals + 1 == text.size())
      throw Error(ErrorKind::bad_input,
                  "--only: '" + text + "' is not of the form key=value; allowed keys: " + join(keys, ", "));
    const std::string key = text.substr(0, equals);
    bool known = false;
    for (const std::string& name : keys) {
      if (normalised_name(name) != normalised_name(key)) continue;
      pairs.emplace_back(name, text.substr(equals + 1));
      known = true;
    }
    if (!known) throw Error(ErrorKind::bad_input, "--only: unknown key '" + key + "'" + suggestion(key, keys));
  }
  return pairs;
}

// A scene fails to load because of the user's files or parameters, so its failure is reported as bad input.
runner::PreparedPlan prepared_plan(suites::Suite suite, const runner::RunOptions& options) {
  try {
    return runner::prepare(std::move(suite), options.cache_folder, options.on_message, options.stop, options.sandbox);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::plugin_failed) throw;
    throw Error(ErrorKind::bad_input, std::string("a scene of the suite cannot be used: ") + error.what());
  }
}

// A run would overwrite the manifest, which records the sources of the merged trials.
void refuse_merged(const fs::path& results) {
  if (const std::optional<records::Manifest> manifest = records::read_manifest(results);
      manifest && !manifest->sources.empty())
    throw Error(ErrorKind::bad_input, "'" + results.string() +
                                          "' is a merged folder; choose another folder with --out, and merge that with "
                                          "the folders that this one was merged from");
}

void print_failures(const runner::RunSummary& summary) {
  constexpr std::size_t kShown = 10;
  for (std::size_t i = 0; i < summary.failures.size() && i < kShown; ++i) print_warning(summary.failures[i]);
  if (summary.failures.size() > kShown)
    print_warning("... and " + std::to_string(summary.failures.size() - kShown) + " more");
  if (!summary.failures.empty()) std::fputs("Causes of failures, and what to do next:\n", stderr);
  for (const std::string& end : summary.failed_ends)
    std::fprintf(stderr, "  %s\n", own_command("explain " + shell_quoted(end)).c_str());
}

// " --plugin PATH" for a plugin outside the scanned folders, empty for others.
std::string plugin_option(const plugin_host::Manifest& plugin) {
  const fs::path folder = fs::weakly_canonical(plugin.folder);
  for (const fs::path& root : plugin_host::Catalog::default_roots())
    if (const fs::path inside = folder.lexically_relative(fs::weakly_canonical(root));
        !inside.empty() && *inside.begin() != "..")
      return "";
  const fs::path typed = plugin.source.extension() == ".py" ? plugin.source : plugin.folder;
  return " --plugin " + shell_quoted(typed.lexically_proximate(fs::current_path()).string());
}

// The id of a choice, or the path of the document that it was read from.
std::string typed_name(const plugin_host::Choice& choice) {
  const plugin_host::Manifest& plugin = *choice.plugin;
  if (plugin.preset(choice.id) != nullptr || !choice.parameters.contains(plugin.document)) return choice.id;
  const fs::path document = choice.parameters.at(plugin.document).get<std::string>();
  return document.stem() == choice.id ? document.lexically_proximate(fs::current_path()).string() : choice.id;
}

// Parameters that differ from the plugin's defaults and the preset's values.
Json own_parameters(const plugin_host::Choice& choice) {
  const plugin_host::Preset* preset = choice.plugin->preset(choice.id);
  Json own = Json::object();
  for (const plugin_host::Parameter& parameter : choice.plugin->parameters) {
    if (parameter.name == choice.plugin->document || !choice.parameters.contains(parameter.name)) continue;
    Json usual = parameter.default_value;
    if (preset != nullptr && preset->parameters.contains(parameter.name)) usual = preset->parameters[parameter.name];
    if (parameter.type == plugin_host::ParameterType::file && usual.is_string() && usual != "")
      usual = (choice.plugin->folder / usual.get<std::string>()).lexically_normal().string();
    if (const Json& value = choice.parameters.at(parameter.name); value != usual) own[parameter.name] = value;
  }
  return own;
}

// The choice as a command-line argument.
std::string typed_choice(const plugin_host::Choice& choice) {
  const std::string name = typed_name(choice);
  const Json parameters = own_parameters(choice);
  if (parameters.empty()) return shell_quoted(name);
  return shell_quoted("{\"use\": " + Json(name).dump() + ", \"parameters\": " + parameters.dump() + "}");
}

// The method for the suggested trial: the best of the last table, otherwise the last of the suite. Excluded are
// baselines that the program added.
const suites::AlgorithmEntry& method_to_watch(const suites::Suite& suite, const std::string& best) {
  const suites::AlgorithmEntry* shown = &suite.algorithms.back();
  for (const suites::AlgorithmEntry& entry : suite.algorithms) {
    if (entry.added) continue;
    shown = &entry;
    if (entry.name == best) break;
  }
  return *shown;
}

// The `try` command that repeats a trial of the suite.
std::string trial_to_watch(const suites::Suite& suite, const std::string& best) {
  const suites::AlgorithmEntry& method = method_to_watch(suite, best);
  const plugin_host::Choice &scene = suite.scenes.back().choice, &level = suite.levels.back().choice;
  std::set<std::string> plugins;
  for (const plugin_host::Choice* used : {&method.choice, &scene, &level}) plugins.insert(plugin_option(*used->plugin));
  std::string command = own_command("try " + typed_choice(method.choice));
  if (typed_choice(scene) != "relign_od") command += " --scene " + typed_choice(scene);
  command += " --noise-level " + typed_choice(level);
  if (method.protocol != "paper") command += " --protocol " + method.protocol;
  if (!method.merit.empty()) command += " --merit " + shell_quoted(method.merit);
  constexpr unsigned kStepsOfTry = 50, kSeedOfTry = 1;
  if (method.steps != kStepsOfTry) command += " --steps " + std::to_string(method.steps);
  if (suite.first_instance != 0) command += " --instance " + std::to_string(suite.first_instance);
  if (suite.seed != kSeedOfTry) command += " --suite-seed " + std::to_string(suite.seed);
  return command + join({plugins.begin(), plugins.end()}, "");
}

// A shard has no report: it has too few instances of each cell.
int print_shard(Context& context, const fs::path& results, const runner::RunSummary& summary) {
  if (context.json) {
    const Json result = {{"results", results.empty() ? Json() : Json(results.string())},
                         {"trials", summary.trials},
                         {"finished", summary.finished},
                         {"reused", summary.reused},
                         {"failed", summary.failed},
                         {"seconds", summary.seconds}};
    print_result(result.dump(2) + "\n");
  } else if (results.empty()) {
    std::fputs("Nothing to do: every trial of this shard is recorded.\n", stderr);
  } else {
    print_result("results  " + results.string() + "\n");
    std::fprintf(stderr, "%zu trials in %s.\nNext, when all shards are complete: %s\n", summary.trials,
                 duration_text(summary.seconds).c_str(),
                 own_command("merge " + shell_quoted(results.parent_path().string()) + " -o DIR").c_str());
  }
  return summary.failed > 0 ? kTrialsFailed : kDone;
}

// Tells a person who waits at a terminal how long it will take. Not for a run that is resumed or partial, whose share
// of the suite is not known here.
void announce_time(Context& context, const runner::PreparedPlan& prepared, const runner::RunOptions& options,
                   ProgressPrinter& progress) {
  if (context.progress_mode() != ProgressMode::line || !options.only.empty() || fs::exists(options.results)) return;
  runner::Progress measuring;
  measuring.doing = "timing the scenes";
  progress.update(measuring);
  const unsigned workers = options.workers == 0 ? core_count() : options.workers;
  const ExpectedTime expected = expected_time(context, prepared.plan.suite, prepared.scenes, workers);
  progress.message("expected time: " + expected.text());
}

int run_suite(Context& context, const RunArguments& arguments) {
  runner::RunOptions options;
  options.only = parse_only(arguments.only);
  options.stop = &watch_for_stop();
  options.workers = arguments.workers;
  options.retry_failed = arguments.retry_failed;
  options.drop_damaged = arguments.drop_damaged;
  if (arguments.isolation == "process") {
    options.worker_program = {"/proc/self/exe", "worker"};
    plugin_host::adopt_orphans();
  }
  options.cache_folder = relign::cache_folder();
  options.command = context.typed_command();
  options.draw_lens = context.extensions.draw_lens;

  if (arguments.suite.empty() == arguments.plan.empty())
    throw Error(ErrorKind::bad_input,
                "SUITE is required: a suite file, or the name of an installed suite such as quick; or --plan FILE with "
                "--shard i/n");
  std::unique_ptr<ShardJob> job;
  context.start_sandbox(arguments.out.empty() ? fs::path("results") : fs::path(arguments.out));
  if (!arguments.plan.empty()) job = std::make_unique<ShardJob>(arguments.plan, arguments.shard, context.sandboxed);
  suites::Suite suite =
      job ? job->read_suite(context.catalog()) : suites::read_suite(suite_file(arguments.suite), context.catalog());
  unseal_suite(suite, arguments.secret);
  if (context.sandboxed) options.sandbox = context.sandbox(suite.trial_memory_mb);
  options.results = arguments.out.empty() ? fs::path("results") / suite.name : fs::path(arguments.out);
  refuse_merged(options.results);

  ProgressPrinter progress(context.progress_mode());
  options.on_progress = [&](const runner::Progress& now) { progress.update(now); };
  options.on_message = [&](const std::string& text) { progress.message(text); };
  runner::Progress preparing;
  preparing.doing = "preparing scenes and plugins";
  progress.update(preparing);
  runner::PreparedPlan prepared = prepared_plan(std::move(suite), options);
  std::unique_ptr<runner::ShardAttempt> attempt;
  if (job) {
    attempt = job->begin(options.results, prepared, options.on_message);
    options.results = attempt->folder();
  }
  if (attempt && prepared.plan.trials.empty()) {
    progress.finish();
    return print_shard(context, "", {});
  }
  if (!attempt) announce_time(context, prepared, options, progress);
  const runner::RunSummary summary = runner::run(prepared, options);
  progress.finish();

  if (summary.stopped) {
    std::fprintf(stderr, "Stopped with %zu of %zu trials done. To resume, run the same command:\n  %s\n",
                 summary.finished, summary.trials, context.typed_command().c_str());
    return stop_exit_code();
  }
  print_failures(summary);
  if (attempt) return print_shard(context, options.results, summary);

  const fs::path page = options.results / "report.html";
  const report::Report report(options.results, std::nullopt, plan_check(context));
  report.write_tables();
  report.write_html(page);
  const bool refuted = warn_of_failed_checks(report);
  if (context.json) {
    const Json result = {{"results", options.results.string()}, {"report", page.string()},  {"trials", summary.trials},
                         {"finished", summary.finished},        {"reused", summary.reused}, {"failed", summary.failed},
                         {"seconds", summary.seconds}};
    print_result(result.dump(2) + "\n");
  } else {
    const std::vector<report::GroupVerdict>& verdict = report.model().verdict;
    const std::string best = verdict.empty() ? "" : verdict.back().best;
    const bool sealed = !prepared.plan.suite.commitment.empty();
    const std::string hint = sealed ? "" : trial_to_watch(prepared.plan.suite, best);
    print_result(report.ranking_table() + "\nresults  " + options.results.string() + "\nreport   " + page.string() +
                 "\n");
    const std::string reused = summary.reused > 0 ? ", " + std::to_string(summary.reused) + " of them reused" : "";
    std::fprintf(stderr, "\n%zu trials in %s%s.\nNext: open the report in a browser%s:\n  %s\n%s", summary.trials,
                 duration_text(summary.seconds).c_str(), reused.c_str(), sealed ? "" : ", or watch one trial",
                 own_command("report " + shell_quoted(options.results.string()) + " --open").c_str(),
                 sealed ? "" : ("  " + hint + "\n").c_str());
    if (summary.failed > 0)
      std::fprintf(stderr, "Failed trials are kept. To run them again:\n  %s --retry-failed\n",
                   context.typed_command().c_str());
  }
  if (refuted) return kGateTripped;
  return summary.failed > 0 ? kTrialsFailed : kDone;
}

}  // namespace

void add_run(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"run", "Run a suite, or resume it, and write its report.",
                                  "relign-bench run suites/quick.json --workers 2\n"
                                  "relign-bench run --plan plan.json --shard 3/40",
                                  "validate, try, report, plan, verify"});
  RunArguments& arguments =
      add_action(verb, context, run_suite, "Stopped before the first trial. To start again, run the same command:");
  verb.add_option("SUITE", arguments.suite, kSuiteHelp)->type_name("SUITE");
  verb.add_option("-o,--out", arguments.out,
                  "results folder; with --plan, the folder of the shards' folders [default: results/NAME, with the "
                  "suite's name]")
      ->type_name("DIR");
  verb.add_option("--workers", arguments.workers, "number of trials to run in parallel [default: all cores]")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, 1024U));
  verb.add_option("--only", arguments.only,
                  "run only these trials: scene=, noise_level=, algorithm=, protocol= or instance=; repeatable")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  verb.add_option("--isolation", arguments.isolation,
                  "process: a plugin that crashes or hangs fails only its trial; none: workers are threads of this "
                  "process, for debugging")
      ->type_name("MODE")
      ->check(CLI::IsMember({"process", "none"}))
      ->capture_default_str();
  add_sandbox_options(verb, context);
  verb.add_flag("--retry-failed", arguments.retry_failed, "rerun trials that failed");
  verb.add_flag("--drop-damaged", arguments.drop_damaged,
                "remove damaged records from the results folder, and run their trials again");
  CLI::Option* plan =
      verb.add_option("--plan", arguments.plan,
                      "plan to run instead of a suite, written by 'relign-bench plan'; requires --shard")
          ->type_name("FILE");
  CLI::Option* shard =
      verb.add_option("--shard", arguments.shard,
                      "shard i of the plan's n, from 0; writes shard-000i.MACHINE in the results folder")
          ->type_name("i/n");
  plan->needs(shard);
  shard->needs(plan);
  add_secret_option(verb, arguments.secret);
  for (const char* other : {"SUITE", "--only"}) plan->excludes(verb.get_option(other));
}

void add_worker(CLI::App& app, Context& context) {
  CLI::App* verb = app.add_subcommand("worker", "Run as a worker process of run.");
  verb->group("");  // hidden
  verb->callback([&context] { context.action = [] { return runner::run_worker(); }; });
}

}  // namespace relign::cli
