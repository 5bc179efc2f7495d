// relign-bench verify: replays trials of a results folder and compares the records.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/characters.h"
#include "base/error.h"
#include "base/own_command.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/frames.h"
#include "cli/interrupt.h"
#include "cli/secrets.h"
#include "records/manifest_check.h"
#include "records/results_folder.h"
#include "runner/verify.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct VerifyArguments {
  std::string results;
  std::size_t sample = 0;
  std::uint64_t seed = 1;
  std::string trial, frames, suite_folder, secret, by;
  unsigned workers = 0;
  bool no_sandbox = false;
};

Json to_json(const runner::ReplayDifference& one) {
  Json json = {{"trial", one.trial},
               {"label", one.label},
               {"line", one.difference.closing ? "closing" : "step"},
               {"field", one.difference.field},
               {"was", one.difference.was},
               {"is", one.difference.is},
               {"compared_with_tolerance", one.tolerated_more}};
  if (!one.difference.closing) json["step"] = one.difference.step;
  return json;
}

Json to_json(const runner::VerifySummary& summary) {
  Json changes = Json::array(), differences = Json::array(), damaged = Json::array();
  for (const records::Damage& one : summary.damaged)
    damaged.push_back({{"trial", one.trial}, {"file", one.file}, {"line", one.line}, {"what", one.what}});
  for (const runner::Change& one : summary.changes)
    changes.push_back({{"what", one.what}, {"was", one.was}, {"is", one.is}});
  for (const runner::ReplayDifference& one : summary.differences) differences.push_back(to_json(one));
  return {{"recorded", summary.recorded},
          {"replayed", summary.replayed},
          {"equal", summary.equal},
          {"equal_with_tolerance", summary.with_tolerance},
          {"tolerance", records::kOtherCpuTolerance},
          {"largest_deviation", summary.largest_deviation},
          {"not_compared", summary.not_compared},
          {"stations", summary.stations},
          {"ended_by_machine", summary.ended_by_machine},
          {"missing", summary.missing},
          {"unknown", summary.unknown},
          {"checks", records::summary_of(summary.checks)},
          {"failed_checks", records::findings_of(summary.checks)},
          {"damaged", std::move(damaged)},
          {"differences", std::move(differences)},
          {"changes", std::move(changes)},
          {"verdict", summary.nothing()     ? "nothing"
                      : summary.all_equal() ? "equal"
                                            : "different"}};
}

std::string verdict(const runner::VerifySummary& summary, bool sampled) {
  std::string text;
  for (const records::Damage& one : summary.damaged) text += "damaged    " + records::to_string(one) + "\n";
  for (const std::string& finding : records::findings_of(summary.checks)) text += "failed     " + finding + "\n";
  if (!records::any_failed(summary.checks)) text += "checks     " + records::summary_of(summary.checks) + "\n";
  for (const runner::ReplayDifference& one : summary.differences)
    text += "different  " + one.trial + " " + one.label + "\n           " + records::to_string(one.difference) +
            (one.tolerated_more ? " (exceeds the tolerance of 1e-6 for another CPU)" : "") + "\n";
  for (const runner::Change& one : summary.changes)
    text += "changed    " + one.what + ": was " + one.was + ", is " + one.is + "\n";
  const bool other_builds = std::any_of(summary.changes.begin(), summary.changes.end(),
                                        [](const runner::Change& one) { return one.what.rfind("plugin ", 0) == 0; });
  const std::size_t exact = summary.equal - summary.with_tolerance;
  text += std::string("replayed   ") + (sampled ? "a sample, " : "") + std::to_string(summary.replayed) + " of " +
          trials_text(summary.recorded) + ": " + std::to_string(exact) + " equal bit for bit";
  if (summary.with_tolerance > 0)
    text += ", " + std::to_string(summary.with_tolerance) + " equal within 1e-6 (largest deviation " +
            significant(summary.largest_deviation) +
            "): recorded on another kind of CPU, with plugins that are reproducible on one kind";
  if (!summary.differences.empty()) text += ", " + std::to_string(summary.differences.size()) + " different";
  text += "\n";
  if (!summary.not_compared.empty())
    text += "skipped    " + records::to_string(summary.not_compared) + ": recorded by a build without this column\n";
  if (summary.missing > 0)
    text += "missing    " + trials_text(summary.missing) + " of the plan, which have no complete record\n";
  if (summary.stations > 0)
    text += "skipped    " + trials_text(summary.stations) + " of a hardware station, which cannot be replayed\n";
  if (summary.ended_by_machine > 0)
    text += "skipped    " + trials_text(summary.ended_by_machine) +
            " that ended by a crash or a limit, which a replay does not repeat\n";
  if (summary.unknown > 0)
    text += "skipped    " + trials_text(summary.unknown) +
            " that this suite does not contain: its data files, or the plugins that it names, have changed\n";
  const bool no_replay = summary.replayed == 0 && summary.unknown == 0;
  text +=
      std::string("verdict    ") +
      (!summary.damaged.empty()
           ? "not reproduced: records are damaged; restore them from a copy, or run the suite again with "
             "--drop-damaged, which runs their trials again"
       : records::any_failed(summary.checks)
           ? "not reproduced: the records contradict the suite or each other; see the failed checks above"
       : no_replay ? "nothing could be replayed"
       : summary.all_equal() && summary.replayed < summary.recorded
           ? "the replayed trials are reproduced; the others were not replayed"
       : summary.all_equal()     ? "the results are reproduced"
       : summary.changes.empty() ? "not reproduced, although program, plugins and CPU are unchanged: records were "
                                   "edited, or something is not "
                                   "deterministic"
                                 : "not reproduced; see the changes listed above") +
      (summary.all_equal() && !summary.not_compared.empty() ? ", except for columns that they do not have" : "") +
      (summary.all_equal() && other_builds ? "; they were recorded with other builds of the plugins named above" : "") +
      "\n";
  return text;
}

// Saves the verdict for report and leaderboard. A read-only results folder is not an error.
void save_verdict(const VerifyArguments& arguments, const runner::VerifySummary& summary) {
  Json details = to_json(summary);
  for (const char* long_list : {"damaged", "differences", "changes", "failed_checks"}) details.erase(long_list);
  records::Replays replays;
  replays.all = {summary.recorded, summary.replayed, summary.equal};
  replays.methods = summary.methods;
  replays.by = arguments.by;
  replays.program = RELIGN_VERSION;
  replays.date = today();
  try {
    records::write_replays(arguments.results, replays, std::move(details));
  } catch (const Error&) {
  }
}

int run_verify(Context& context, const VerifyArguments& arguments) {
  if (!arguments.frames.empty() && arguments.trial.empty())
    throw Error(ErrorKind::bad_input, "--frames: requires --trial ID; it writes the captures of one trial");
  if (const std::string mistake = line_mistake(arguments.by); !mistake.empty())
    throw Error(ErrorKind::bad_input, "--by: " + mistake);
  runner::VerifyOptions options;
  options.results = arguments.results;
  options.sample = arguments.sample;
  options.seed = arguments.seed;
  options.trial = arguments.trial;
  options.suite_folder = arguments.suite_folder;
  options.secret = given_secret(arguments.secret).value_or("");
  options.workers = arguments.workers;
  options.cache_folder = cache_folder();
  options.stop = &watch_for_stop();
  context.start_sandbox(arguments.results);
  if (!context.sandboxed && !arguments.no_sandbox && records::manifest_of(arguments.results).ran_in_sandbox())
    throw Error(
        ErrorKind::bad_input,
        "the algorithms of '" + arguments.results +
            "' ran in a sandbox; replay them with --sandbox, or with --no-sandbox if they may have your rights");
  options.sandbox = context.sandbox();
  ProgressPrinter progress(context.progress_mode());
  options.on_message = [&progress](const std::string& text) { progress.message(text); };
  options.on_progress = [&progress](std::size_t done, std::size_t total) {
    runner::Progress now;
    now.total = total;
    now.done = done;
    now.doing = "replaying";
    progress.update(now);
  };
  std::size_t frames = 0;
  if (!arguments.frames.empty())
    options.on_step = [&](const trials::SceneFacts& facts, const trials::Step& step, const float* pixels) {
      save_frame(arguments.frames, step.step, facts, pixels);
      ++frames;
    };
  const runner::VerifySummary summary = runner::verify(options, context.catalog());
  progress.finish();
  if (summary.stopped) {
    std::fprintf(stderr, "Stopped after %zu replays; their results are not kept.\n", summary.replayed);
    return stop_exit_code();
  }
  if (arguments.trial.empty() && summary.replayed > 0) save_verdict(arguments, summary);
  if (context.json) {
    Json result = to_json(summary);
    if (!arguments.frames.empty()) result["frames"] = {{"folder", arguments.frames}, {"count", frames}};
    print_result(result.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
  } else {
    print_text(
        verdict(summary, arguments.sample > 0) +
        (arguments.frames.empty() ? "" : "frames     " + std::to_string(frames) + " in " + arguments.frames + "\n"));
  }
  return summary.all_equal() && !summary.nothing() ? kDone : kGateTripped;
}

}  // namespace

void add_verify(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"verify",
                                  "Check the records of a results folder against its suite, replay trials and compare "
                                  "every recorded line bit for bit.",
                                  "relign-bench verify results/quick --sample 20\n"
                                  "relign-bench verify results/quick --trial 4f1c0a9b2d3e4f50 --frames frames",
                                  "run, merge, try"});
  VerifyArguments& arguments =
      add_action(verb, context, run_verify, "Stopped after 0 replays; their results are not kept.");
  verb.add_option("DIR", arguments.results, "results folder")->required()->type_name("DIR");
  verb.add_option("--sample", arguments.sample, "number of trials to replay, spread over the algorithms [default: all]")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, 100000000U));
  verb.add_option("--seed", arguments.seed, "seed that selects the sample")
      ->type_name("SEED")
      ->check(whole_number())
      ->capture_default_str();
  verb.add_option("--trial", arguments.trial, "replay only this trial; instances.csv lists the ids")
      ->type_name("TRIAL");
  verb.add_option("--frames", arguments.frames, "with --trial: write its captures to DIR/step-NNN.png")
      ->type_name("DIR");
  verb.add_option(
          "--suite-folder", arguments.suite_folder,
          "base folder of the suite's relative paths [default: the suite file's folder, as recorded in the manifest]")
      ->type_name("DIR");
  verb.add_option("--by", arguments.by, "who replays, for the leaderboard [default: not stated]")->type_name("NAME");
  add_sandbox_options(verb, context);
  verb.add_flag("--no-sandbox", arguments.no_sandbox,
                "replay results of a sandbox without one: algorithms can then read and change your files")
      ->excludes("--sandbox");
  add_secret_option(verb, arguments.secret);
  verb.add_option("--workers", arguments.workers, "number of trials to run in parallel [default: all cores]")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, 1024U));
}

}  // namespace relign::cli
