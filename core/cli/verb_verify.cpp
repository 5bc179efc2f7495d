// relign-bench verify: trials of a results folder run again and compared.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/frames.h"
#include "cli/interrupt.h"
#include "runner/verify.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct VerifyArguments {
  std::string results;
  std::size_t sample = 0;
  std::uint64_t seed = 1;
  std::string trial, frames, suite_folder;
  unsigned workers = 0;
  bool add_rules = false;
};

std::string trials_text(std::size_t count) { return std::to_string(count) + (count == 1 ? " trial" : " trials"); }

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
  Json changes = Json::array(), differences = Json::array();
  for (const runner::Change& one : summary.changes)
    changes.push_back({{"what", one.what}, {"was", one.was}, {"is", one.is}});
  for (const runner::ReplayDifference& one : summary.differences) differences.push_back(to_json(one));
  return {{"recorded", summary.recorded},
          {"replayed", summary.replayed},
          {"equal", summary.equal},
          {"equal_with_tolerance", summary.with_tolerance},
          {"tolerance", records::kOtherCpuTolerance},
          {"largest_deviation", summary.largest_deviation},
          {"stations", summary.stations},
          {"ended_by_machine", summary.ended_by_machine},
          {"unknown", summary.unknown},
          {"completed", summary.completed},
          {"differences", std::move(differences)},
          {"changes", std::move(changes)},
          {"verdict", summary.all_equal() ? "equal" : "different"}};
}

std::string verdict(const runner::VerifySummary& summary) {
  std::string text;
  for (const runner::ReplayDifference& one : summary.differences)
    text += "different  " + one.trial + " " + one.label + "\n           " + records::to_string(one.difference) +
            (one.tolerated_more ? " (beyond the tolerance of 1e-6 for another CPU)" : "") + "\n";
  for (const runner::Change& one : summary.changes)
    text += "changed    " + one.what + ": was " + one.was + ", is " + one.is + "\n";
  const std::size_t exact = summary.equal - summary.with_tolerance;
  text += "replayed   " + std::to_string(summary.replayed) + " of " + trials_text(summary.recorded) + ": " +
          std::to_string(exact) + " equal bit for bit";
  if (summary.with_tolerance > 0)
    text += ", " + std::to_string(summary.with_tolerance) + " equal within 1e-6 (largest deviation " +
            significant(summary.largest_deviation) +
            "): made on another CPU by plugins that promise equal numbers on one alone";
  if (!summary.differences.empty()) text += ", " + std::to_string(summary.differences.size()) + " different";
  text += "\n";
  if (summary.stations > 0)
    text += "not done   " + trials_text(summary.stations) + " of a station, which cannot be replayed\n";
  if (summary.ended_by_machine > 0)
    text += "not done   " + trials_text(summary.ended_by_machine) +
            " that a crash or a limit ended, which is not in the record\n";
  if (summary.unknown > 0)
    text += "not done   " + trials_text(summary.unknown) +
            " that the suite does not have here: its data files, or what its names stand for, are others than then\n";
  if (summary.completed > 0)
    text += "added      the scores of the rules best and current to " + trials_text(summary.completed) +
            "; 'relign-bench report' shows them\n";
  const bool nothing = summary.replayed == 0 && summary.unknown == 0;
  text += std::string("verdict    ") +
          (nothing               ? "nothing could be replayed"
           : summary.all_equal() ? "the results are reproduced"
           : summary.changes.empty()
               ? "not reproduced, though program, plugins and CPU are those of then: something is not reproducible"
               : "not reproduced; what changed since then is above") +
          "\n";
  return text;
}

// The report shows it. Results in a folder that cannot be written are verified all the same.
void keep(const std::string& results, const runner::VerifySummary& summary) {
  Json said = to_json(summary);
  said["format"] = records::kFormat;
  for (const char* long_list : {"differences", "changes", "completed"}) said.erase(long_list);
  try {
    write_file_atomically(std::filesystem::path(results) / "verify.json", said.dump(1) + "\n");
  } catch (const Error&) {
  }
}

int run_verify(Context& context, const VerifyArguments& arguments) {
  if (!arguments.frames.empty() && arguments.trial.empty())
    throw Error(ErrorKind::bad_input, "--frames writes the frames of one trial: give --trial ID too");
  runner::VerifyOptions options;
  options.results = arguments.results;
  options.sample = arguments.sample;
  options.seed = arguments.seed;
  options.trial = arguments.trial;
  options.suite_folder = arguments.suite_folder;
  options.workers = arguments.workers;
  options.add_rules = arguments.add_rules;
  options.cache_folder = cache_folder();
  options.stop = &watch_for_stop();
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
      save_frame(arguments.frames, step.number, facts, pixels);
      ++frames;
    };
  runner::VerifySummary summary;
  try {
    summary = runner::verify(options, context.catalog());
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::stopped) throw;
    summary.stopped = true;
  }
  progress.finish();
  if (summary.stopped) {
    std::fprintf(stderr, "Stopped after %zu replays; nothing is kept of them.\n", summary.replayed);
    return stop_exit_code();
  }
  if (arguments.add_rules && summary.recorded == 0) {
    print_result(context.json ? to_json(summary).dump(2) + "\n"
                              : "Every trial of " + arguments.results + " has the scores of all rules.\n");
    return kDone;
  }
  if (arguments.trial.empty() && !arguments.add_rules && summary.replayed > 0) keep(arguments.results, summary);
  if (context.json) {
    Json result = to_json(summary);
    if (!arguments.frames.empty()) result["frames"] = {{"folder", arguments.frames}, {"count", frames}};
    print_result(result.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
  } else {
    print_text(verdict(summary) + (arguments.frames.empty()
                                       ? ""
                                       : "frames     " + std::to_string(frames) + " in " + arguments.frames + "\n"));
  }
  return summary.all_equal() ? kDone : kGateTripped;
}

}  // namespace

void add_verify(CLI::App& app, Context& context) {
  CLI::App& verb =
      add_verb(app, {"verify", "Run trials of a results folder again and compare every recorded line bit for bit.",
                     "relign-bench verify results/quick --sample 20\n"
                     "relign-bench verify results/quick --trial 4f1c0a9b2d3e4f50 --frames frames",
                     "run, merge, try"});
  auto arguments = std::make_shared<VerifyArguments>();
  verb.add_option("DIR", arguments->results, "results folder")->required()->type_name("DIR");
  verb.add_option("--sample", arguments->sample,
                  "replay this many trials, spread over the algorithms [default: all of them]")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, 100000000U));
  verb.add_option("--seed", arguments->seed, "which trials a sample takes")
      ->type_name("SEED")
      ->check(whole_number())
      ->capture_default_str();
  verb.add_option("--trial", arguments->trial, "replay this trial alone; instances.csv lists the ids")
      ->type_name("TRIAL");
  verb.add_option("--frames", arguments->frames, "with --trial: write its captures there as step-NNN.png")
      ->type_name("DIR");
  verb.add_flag("--add-rules", arguments->add_rules,
                "replay the trials that lack the scores of the rules best and current, and add them where all else is "
                "equal");
  verb.add_option("--suite-folder", arguments->suite_folder,
                  "what the suite's relative paths are below [default: its file's folder, as the manifest names it]")
      ->type_name("DIR");
  verb.add_option("--workers", arguments->workers, "trials at the same time [default: all cores]")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, 1024U));
  verb.callback(
      [&context, arguments] { context.action = [&context, arguments] { return run_verify(context, *arguments); }; });
}

}  // namespace relign::cli
