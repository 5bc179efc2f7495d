#include "trials/run_service.h"

#include <algorithm>
#include <cstring>

#include "base/json_source.h"
#include "base/seeds.h"
#include "base/text.h"
#include "plugin_host/manifest.h"
#include "trials/nested.h"
#include "trials/service_answer.h"
#include "trials/trial_host.h"

namespace relign::trials {
namespace {

constexpr std::size_t kMinOutcomeSize = offsetof(relign_run_outcome, recommendation) + sizeof(const double*);

// The algorithm that `parameter` names, with the caller's changes to its parameters.
plugin_host::Choice chosen(const plugin_host::Choice& caller, const std::string& parameter,
                           const std::string& parameters_json) {
  std::vector<std::string> names;
  for (const auto& [name, choice] : caller.algorithms) {
    names.push_back(name);
    if (normalised_name(name) != normalised_name(parameter)) continue;
    const Json changes =
        parameters_json.empty() ? Json::object() : JsonSource::from_text(parameters_json, "parameters").root();
    return plugin_host::with_changes(*choice, changes);
  }
  throw Error(ErrorKind::bad_input, "'" + caller.plugin->id + "' has no parameter '" + parameter +
                                        "' of type algorithm" + suggestion(parameter, names));
}

// Applies the inner algorithm's move limit while it runs.
class ScopedLargestMove {
 public:
  ScopedLargestMove(TrialHost& host, double largest) : host_(host), before_(host.set_largest_move(largest)) {}
  ~ScopedLargestMove() { host_.set_largest_move(before_); }
  ScopedLargestMove(const ScopedLargestMove&) = delete;
  ScopedLargestMove& operator=(const ScopedLargestMove&) = delete;

 private:
  TrialHost& host_;
  double before_;
};

}  // namespace

bool offer(ServiceContext& shared, relign_run_service& table) {
  if (shared.view.algorithm().algorithms.empty()) return false;
  if (!shared.run) shared.run = std::make_unique<RunService>(shared);
  table.run = [](void* context, relign_text parameter, relign_text parameters_json, std::uint32_t most_steps,
                 relign_run_outcome* outcome) {
    return answer(context, [&](ServiceContext& now) -> relign_status {
      if (!outcome || outcome->struct_size < kMinOutcomeSize)
        return now.refuse("'outcome' is null or its struct_size too small");
      if (most_steps == 0) return now.refuse("expected at least 1 step, found 0");
      const plugin_host::Choice inner = chosen(now.view.algorithm(), text_of(parameter), text_of(parameters_json));
      relign_run_outcome written{};
      written.struct_size = static_cast<std::uint32_t>(std::min<std::size_t>(outcome->struct_size, sizeof written));
      const relign_status status = now.run->run_inner(inner, most_steps, written);
      std::memcpy(outcome, &written, written.struct_size);
      return status;
    });
  };
  return true;
}

relign_status RunService::run_inner(const plugin_host::Choice& inner, std::uint32_t most_steps,
                                    relign_run_outcome& outcome) {
  TrialHost& host = shared_->host;
  TrialView& outer = shared_->view;
  const TrialSetup& setup = host.setup();
  const unsigned budget = std::min(most_steps, outer.steps_left());
  if (budget == 0 || host.stop_requested()) return stop(*shared_);
  const bool start_is_hidden = (outer.table().task->observes & RELIGN_OBSERVES_START) == 0;
  if (const std::string mistake =
          plugin_host::nesting_mistake(*outer.algorithm().plugin, *inner.plugin, start_is_hidden);
      !mistake.empty())
    return shared_->refuse(mistake);

  const Rules rules = make_rules(setup.terms.protocol, *inner.plugin, setup.instance, setup.scene);
  const std::uint64_t seed = algorithm_seed(outer.table().task->seed, inner.id, runs_++);
  NestedTrial nested(host, outer, inner, budget, seed, rules.largest_move);
  relign_status status = RELIGN_OK;
  host.select_regions({});  // what the outer algorithm selected was for its own capture
  try {
    const ScopedLargestMove limit(host, nested.table().task->largest_move);
    plugin_host::Algorithm algorithm(inner, setup.services);
    algorithm.run(nested.table());
  } catch (const Error& error) {
    // Exceptions of the scene or of on_step are not failures of the inner algorithm.
    if (host.host_failed() || error.kind() != ErrorKind::plugin_failed) throw;
    shared_->why = error.what();
    status = RELIGN_FAILED;
  }

  outcome.steps = nested.steps();
  const bool finished = !nested.stopped() && nested.steps_left() > 0;
  outcome.end = finished ? RELIGN_RUN_FINISHED : RELIGN_RUN_STEPS_SPENT;
  last_.struct_size = sizeof last_;
  outer.write_observation(&last_);
  outcome.last = &last_;
  if (outer.table().task->observes & RELIGN_OBSERVES_MERIT && !nested.best_pose().empty()) {
    best_pose_ = nested.best_pose();
    best_ = nested.best();
    best_.pose = best_pose_.data();
    if (best_.step != last_.step) best_.image = nullptr;
    outcome.best = &best_;
  }
  if (nested.recommendation()) {
    recommendation_ = *nested.recommendation();
    outcome.recommendation = recommendation_.data();
  }
  return status;
}

}  // namespace relign::trials
