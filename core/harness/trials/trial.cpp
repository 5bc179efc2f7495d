#include "trials/trial.h"

#include <chrono>
#include <utility>

#include "base/error.h"
#include "trials/conversation.h"

namespace relign::trials {

const char* recommendation_source_name(RecommendationSource source) {
  switch (source) {
    case RecommendationSource::own:
      return "own";
    case RecommendationSource::best_measured:
      return "best_measured";
    case RecommendationSource::current:
      return "current";
  }
  return "";
}

plugin_host::HostServices algorithm_services(const TrialSetup& setup) {
  plugin_host::HostServices services = setup.services;
  services.stop = setup.stop;
  return services;
}

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
  const bool placed = setup.scene && (setup.scene->owns_stage ? setup.station != nullptr : setup.assembly != nullptr);
  if (!placed || !setup.instance || !setup.algorithm || !setup.algorithm->plugin)
    throw Error(ErrorKind::internal, "run_trial needs an assembly or a station, a scene, an instance and an algorithm");
  const relign_image& reference = setup.reference;
  const std::string who = "scene '" + setup.scene->name + "': ";
  if (reference.width != setup.scene->image_width || reference.height != setup.scene->image_height)
    throw Error(ErrorKind::plugin_failed, who + "its reference has " + std::to_string(reference.width) + " x " +
                                              std::to_string(reference.height) + " pixels, its description says " +
                                              std::to_string(setup.scene->image_width) + " x " +
                                              std::to_string(setup.scene->image_height));
}

// Runs the algorithm; the message is the sentence of its failure, empty when it returned well.
TrialResult drive(const TrialSetup& setup, Conversation& conversation) {
  plugin_host::EnvironmentWatch watch;
  TrialResult result;
  try {
    plugin_host::Algorithm algorithm(*setup.algorithm, algorithm_services(setup));
    conversation.algorithm_starts();
    algorithm.run(conversation.table());
    conversation.algorithm_ended();
  } catch (const std::exception& error) {
    conversation.algorithm_ended();
    const auto* ours = dynamic_cast<const Error*>(&error);
    const bool algorithms_own = ours && ours->kind() == ErrorKind::plugin_failed;
    // The host's own failures leave from close(); what is left was refused before the trial began.
    if (!conversation.host_failed() && !algorithms_own) throw;
    result.message = error.what();
    if (const auto* ended = dynamic_cast<const plugin_host::PluginEnded*>(&error)) result.outcome = ended->outcome();
  }
  result.environment_changes = watch.changes();
  return result;
}

// By each rule, each pose once.
void measure_mtf(const TrialSetup& setup, const Conversation& conversation, TrialResult& result) {
  std::map<std::vector<double>, std::optional<plugin_host::MountedAssembly::FieldMtf>> known;
  const auto at = [&](const std::vector<double>& pose) {
    auto found = known.find(pose);
    if (found == known.end()) found = known.emplace(pose, setup.assembly->mtf(pose, setup.mtf_lp_per_mm)).first;
    return found->second;
  };
  const std::vector<double>& uncured = conversation.uncured_true_pose();
  const bool shifts = !uncured.empty();
  result.mtf.glued = at(result.steps.back().recommended_true_pose);
  if (shifts) result.mtf.uncured = at(uncured);
  const Step* best = &result.steps.front();
  for (const Step& step : result.steps)
    if (step.measured_rmse < best->measured_rmse) best = &step;
  const auto of_step = [&](const Step& step) {
    TrialResult::GluedMtf mtf;
    mtf.glued = at(conversation.glued_true_pose(step));
    if (shifts) mtf.uncured = at(step.true_pose);
    return mtf;
  };
  result.best_mtf = of_step(*best);
  result.current_mtf = of_step(result.steps.back());
}

}  // namespace

TrialResult run_trial(const TrialSetup& setup) {
  check(setup);
  Rules rules = make_rules(setup.protocol, *setup.algorithm->plugin, *setup.instance, *setup.scene);
  if (setup.merit && *setup.merit != rules.merit) {
    if (setup.scene->owns_stage)
      throw Error(ErrorKind::bad_input,
                  "merit \"combined\" needs the true pose, which nobody knows on a station: use \"rmse\"");
    rules.merit = *setup.merit;
  }

  Conversation conversation(setup, std::move(rules));
  TrialResult result = drive(setup, conversation);
  conversation.close();

  if (!conversation.refusal().empty()) result.message = conversation.refusal();
  // A failure while the run is being stopped may come of that: a process that hangs is not waited for any longer.
  const bool gave_up = !result.message.empty() && setup.stop && setup.stop->load();
  if (conversation.was_stopped() || gave_up)
    result.end = End::stopped;
  else if (!conversation.refusal().empty() && conversation.budget_is_spent())
    result.end = End::overspent;
  else if (!result.message.empty())
    result.end = End::failed;
  else
    result.end = conversation.budget_is_spent() ? End::budget_spent : End::finished;
  result.seconds_after_last_step = conversation.seconds_after_last_step();
  const auto begin = std::chrono::steady_clock::now();
  result.uncured_mse = conversation.uncured_truth().mse;
  if (result.end != End::stopped) result.glued_truths = conversation.glued_truths();
  result.steps = conversation.take_steps();
  if (setup.mtf_lp_per_mm > 0 && setup.assembly && !result.steps.empty() && result.end != End::stopped)
    measure_mtf(setup, conversation, result);
  result.judging_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace relign::trials
