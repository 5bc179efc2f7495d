#include "trials/trial.h"

#include <chrono>
#include <map>
#include <utility>

#include "base/error.h"
#include "base/fault.h"
#include "trials/trial_host.h"

namespace relign::trials {

const char* end_name(End end) {
  switch (end) {
    case End::budget_spent:
      return "budget_spent";
    case End::finished:
      return "finished";
    case End::failed:
      return "failed";
    case End::overspent:
      return "overspent";
    case End::stopped:
      return "stopped";
  }
  return "";
}

namespace {

void check(const TrialSetup& setup) {
  if (setup.scene.owns_stage != std::holds_alternative<Station>(setup.stage) || !setup.algorithm.plugin)
    throw Error(ErrorKind::internal, "run_trial needs the stage of its scene and an algorithm");
  const relign_image& reference = setup.reference;
  const std::string who = "scene '" + setup.scene.name + "': ";
  if (reference.width != setup.scene.image_width || reference.height != setup.scene.image_height)
    throw Error(ErrorKind::plugin_failed, who + "the reference image has " + std::to_string(reference.width) + " x " +
                                              std::to_string(reference.height) + " pixels; expected " +
                                              std::to_string(setup.scene.image_width) + " x " +
                                              std::to_string(setup.scene.image_height) + " as in its description");
}

// Runs the algorithm. The message in the result is empty when it returned without a failure.
TrialResult run_algorithm(const TrialSetup& setup, TrialHost& host) {
  plugin_host::EnvironmentWatch watch;
  TrialResult result;
  try {
    plugin_host::Algorithm algorithm(setup.algorithm, setup.services);
    host.algorithm_starts();
    algorithm.run(host.table());
    host.algorithm_ended();
  } catch (const std::exception& error) {
    host.algorithm_ended();
    const auto* ours = dynamic_cast<const Error*>(&error);
    const bool algorithms_own = ours && ours->kind() == ErrorKind::plugin_failed;
    // close() rethrows the host's failures; any other exception here means a library that was refused before the trial.
    if (!host.host_failed() && !algorithms_own) throw;
    result.message = fault_text(error);
    if (const auto* ended = dynamic_cast<const plugin_host::PluginEnded*>(&error)) result.outcome = ended->outcome();
  }
  result.environment_changes = watch.changes();
  return result;
}

// Measures the MTF by each recommendation rule, and at each pose once.
void measure_mtf(plugin_host::MountedAssembly& lens, double lp_per_mm, const TrialHost& host, records::Scores& scores) {
  std::map<std::vector<double>, records::MtfRecord> known;
  for (const records::Rule rule : records::kRules)
    for (const records::Curing curing : records::kCuring) {
      const std::vector<double> pose = host.last_pose(rule)[curing];
      if (pose.empty()) continue;
      auto found = known.find(pose);
      if (found == known.end()) found = known.emplace(pose, mtf_at(lens, pose, lp_per_mm)).first;
      scores.mtf[rule][curing] = found->second;
    }
}

}  // namespace

records::MtfRecord mtf_at(plugin_host::MountedAssembly& lens, const std::vector<double>& true_pose, double lp_per_mm) {
  const auto found = lens.mtf(true_pose, lp_per_mm);
  return found ? records::MtfRecord{found->centre, found->corner} : records::MtfRecord();
}

TrialResult run_trial(const TrialSetup& setup) {
  check(setup);
  Rules rules = make_rules(setup.terms.protocol, *setup.algorithm.plugin, setup.instance, setup.scene);
  if (setup.terms.merit && *setup.terms.merit != rules.merit) {
    if (setup.scene.owns_stage && *setup.terms.merit == Merit::combined)
      throw Error(ErrorKind::bad_input,
                  "merit 'combined' needs the true pose, which is unknown on a station; use 'rmse'");
    rules.merit = *setup.terms.merit;
  }

  TrialHost host(setup, std::move(rules));
  TrialResult result = run_algorithm(setup, host);
  host.close();

  if (!host.refusal().empty()) result.message = host.refusal();
  // A failure during a stop may be caused by it, because the host stops waiting for processes that hang.
  const bool failed_while_stopping = !result.message.empty() && setup.services.stop && setup.services.stop->load();
  if (host.was_stopped() || failed_while_stopping)
    result.end = End::stopped;
  else if (!host.refusal().empty() && host.budget_is_spent())
    result.end = End::overspent;
  else if (!result.message.empty())
    result.end = End::failed;
  else
    result.end = host.budget_is_spent() ? End::budget_spent : End::finished;
  result.seconds_after_last_step = host.seconds_after_last_step();
  const auto begin = std::chrono::steady_clock::now();
  const auto* lens = std::get_if<SimulatedLens>(&setup.stage);
  const Scoring* scoring = setup.scoring();
  if (result.end != End::stopped) {
    result.scores = host.scores();
    if (lens && scoring && scoring->mtf_lp_per_mm > 0)
      measure_mtf(lens->assembly, scoring->mtf_lp_per_mm, host, result.scores);
  }
  result.steps = host.take_steps();
  result.judging_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace relign::trials
