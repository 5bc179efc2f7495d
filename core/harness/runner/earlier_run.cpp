#include "runner/earlier_run.h"

#include <filesystem>
#include <set>
#include <system_error>

namespace relign::runner {
namespace fs = std::filesystem;

struct EarlierRun::Outdated {
  std::set<std::string> trials;
  std::map<std::string, std::size_t> changed;  // plugin id -> trials
  std::size_t renamed = 0, retried = 0, anonymous = 0;
};

EarlierRun::EarlierRun(const PreparedPlan& plan, const RunOptions& options, const std::vector<std::size_t>& selected,
                       records::ResultsWriter& writer, RunReporter& reporter)
    : plan_(plan),
      suite_(plan.plan.suite),
      options_(options),
      selected_(selected),
      writer_(writer),
      reporter_(reporter),
      manifest_(records::read_manifest(writer.folder())) {}

void EarlierRun::drop_outdated(const PluginsOf& plugins_of) {
  const std::map<std::string, records::FinishedTrial> finished = writer_.finished();
  Outdated outdated;
  for (const std::size_t place : selected_) {
    const suites::PlannedTrial& trial = plan_.plan.trials[place];
    const auto found = finished.find(trial.id);
    if (found != finished.end()) check(place, found->second, plugins_of(trial), outdated);
  }
  report(outdated);
  writer_.drop(outdated.trials);
  for (const std::string& trial : outdated.trials) {
    std::error_code code;
    fs::remove_all(options_.results / "pictures" / trial, code);
  }
}

void EarlierRun::check(std::size_t place, const records::FinishedTrial& before, const records::PluginHashes& now,
                       Outdated& outdated) const {
  const suites::PlannedTrial& trial = plan_.plan.trials[place];
  const plugin_host::Choice& algorithm = suite_.algorithms[trial.algorithm].choice;
  const auto changed = [&](const std::string& was, const std::string& is, const plugin_host::Choice& choice) {
    if (was.empty() || was == is) return false;
    ++outdated.changed[choice.plugin->id];
    return true;
  };
  const bool other_scene = changed(before.plugins.scene, now.scene, suite_.scenes[trial.scene].choice);
  const bool other_level = changed(before.plugins.noise_level, now.noise_level, suite_.levels[trial.level].choice);
  const bool other_algorithm = changed(before.plugins.algorithm, now.algorithm, algorithm);
  // Also when pretraining failed before, and the trials with it.
  const bool other_pretraining = !other_algorithm && !now.prepared.empty() && before.plugins.prepared != now.prepared;
  if (other_pretraining) ++outdated.changed["pretrained data of " + algorithm.plugin->id];
  if (other_scene) remove_scene_files(trial.scene);
  const bool retried = options_.retry_failed && !records::ended_well(before.end);
  if (retried) ++outdated.retried;
  // Which plugins made it is unknown: the files of times/ are lost.
  const bool anonymous = before.plugins.algorithm.empty() && !now.algorithm.empty();
  if (anonymous) ++outdated.anonymous;
  const bool renamed =
      before.scene != suite_.scenes[trial.scene].name || before.noise_level != suite_.levels[trial.level].name;
  if (other_scene || other_level || other_algorithm || other_pretraining || retried || anonymous) {
    outdated.trials.insert(trial.id);
  } else if (renamed) {
    ++outdated.renamed;
    outdated.trials.insert(trial.id);
  }
}

void EarlierRun::report(const Outdated& outdated) const {
  for (const auto& [plugin, trials] : outdated.changed)
    reporter_.message(plugin + " changed: " + std::to_string(trials) +
                      (trials == 1 ? " trial runs again" : " trials run again"));
  if (outdated.retried > 0)
    reporter_.message(std::to_string(outdated.retried) +
                      (outdated.retried == 1 ? " failed trial runs" : " failed trials run") + " again");
  if (outdated.anonymous > 0)
    reporter_.message(
        "times/ does not tell which plugins made " + std::to_string(outdated.anonymous) +
        (outdated.anonymous == 1 ? " finished trial; it runs again" : " finished trials; they run again"));
  if (outdated.renamed > 0)
    reporter_.message("scenes or noise levels were renamed in the suite: " + std::to_string(outdated.renamed) +
                      (outdated.renamed == 1 ? " trial runs again" : " trials run again"));
}

void EarlierRun::remove_scene_files(std::size_t scene) const {
  std::error_code code;  // ignored: remaining pictures are overwritten or still valid
  fs::remove_all(options_.results / scene_folder(plan_, scene), code);
  fs::remove_all(options_.results / "pictures" / suite_.scenes[scene].name, code);
}

void EarlierRun::compare_sandbox() const {
  const bool was = manifest_ && manifest_->sandbox, is = options_.sandbox != nullptr;
  if (!manifest_ || was == is || writer_.finished_trials().empty()) return;
  throw Error(ErrorKind::bad_input, "the trials in '" + options_.results.string() + "' ran " +
                                        (was ? "in a sandbox, and this command has no --sandbox"
                                             : "without a sandbox, and this command has --sandbox") +
                                        "; choose another folder with --out");
}

void EarlierRun::compare_with(records::Manifest& manifest) const {
  if (!manifest_) return;
  std::set<std::string> planned;
  for (const suites::PlannedTrial& trial : plan_.plan.trials) planned.insert(trial.id);
  std::size_t kept = 0;
  std::size_t extra = 0;
  for (const std::string& trial : writer_.finished_trials()) ++(planned.count(trial) ? kept : extra);
  if (kept + extra > 0)
    for (const records::Program& program : manifest_->builds())
      if (program.hash != manifest.program.hash) manifest.earlier_programs.push_back(program);
  if (const std::string note = manifest.builds_note(); kept > 0 && !note.empty())
    reporter_.message(note + "; " + std::to_string(kept) +
                      " finished trials are kept (choose a new folder with --out to run all of them again)");
  if (extra == 0) return;
  const std::string file = manifest_->suite_file;
  const bool same_file = file.empty() || file == suite_.file;
  reporter_.message(std::to_string(extra) + (extra == 1 ? " finished trial in " : " finished trials in ") +
                    options_.results.string() + (extra == 1 ? " belongs to " : " belong to ") +
                    (same_file ? "an earlier version of the suite"
                               : "another suite, " + file + " (this one is " + suite_.file + ")") +
                    (extra == 1 ? "; it is kept but not shown" : "; they are kept but not shown") +
                    (same_file ? "" : "; give the suites different names, or one of them another folder with --out"));
}

void EarlierRun::mark_changed_analysis(records::Manifest& manifest) const {
  if (!manifest_ || writer_.finished_trials().empty()) return;
  const auto hash_or_none = [](const std::string& hash) { return hash.empty() ? std::string("none") : hash; };
  const std::string first =
      manifest_->analysis_began_with.empty() ? hash_or_none(manifest_->analysis_hash) : manifest_->analysis_began_with;
  if (first == hash_or_none(manifest.analysis_hash)) return;
  manifest.analysis_began_with = first;
  reporter_.message(
      "the suite's analysis plan has changed since the first of these results; the report marks it as changed");
}

void EarlierRun::keep_secret(records::Manifest& manifest) const {
  if (manifest_ && !suite_.commitment.empty() && manifest_->commitment == suite_.commitment)
    manifest.secret = manifest_->secret;
}

EarlierRun::Remaining EarlierRun::remaining() const {
  const std::map<std::string, records::FinishedTrial> finished = writer_.finished();
  Remaining remaining;
  for (const std::size_t place : selected_) {
    const auto found = finished.find(plan_.plan.trials[place].id);
    if (found == finished.end()) {
      remaining.places.push_back(place);
      continue;
    }
    ++remaining.finished;
    if (!records::ended_well(found->second.end)) ++remaining.failed;
  }
  return remaining;
}

}  // namespace relign::runner
