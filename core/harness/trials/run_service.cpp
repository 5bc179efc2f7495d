#include "trials/run_service.h"

#include <algorithm>
#include <cstring>

#include "base/json_source.h"
#include "base/seeds.h"
#include "base/text.h"
#include "trials/conversation.h"
#include "trials/nested.h"
#include "trials/service_answer.h"

namespace relign::trials {
namespace {

// The members that a caller of interface version 1.0 has room for.
constexpr std::size_t kSmallestOutcome = offsetof(relign_run_outcome, recommendation) + sizeof(const double*);

// The chosen algorithm, with the caller's changes to its parameters.
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

// The inner algorithm's own limit for as long as it runs.
class LargestMove {
 public:
  LargestMove(Conversation& host, double largest) : host_(host), before_(host.set_largest_move(largest)) {}
  ~LargestMove() { host_.set_largest_move(before_); }
  LargestMove(const LargestMove&) = delete;
  LargestMove& operator=(const LargestMove&) = delete;

 private:
  Conversation& host_;
  double before_;
};

}  // namespace

RunService::RunService(ServiceSite& site) : site_(&site) {
  table_.struct_size = sizeof table_;
  table_.context = this;
  table_.run = run;
  table_.why = why;
}

relign_status RunService::run(void* context, relign_text parameter, relign_text parameters_json,
                              std::uint32_t most_steps, relign_run_outcome* outcome) {
  RunService& service = *static_cast<RunService*>(context);
  return service.site_->answer([&]() -> relign_status {
    if (!outcome || outcome->struct_size < kSmallestOutcome)
      return service.site_->refuse("there is no place for the outcome");
    if (most_steps == 0) return service.site_->refuse("expected at least one step");
    const plugin_host::Choice inner =
        chosen(service.site_->seat.algorithm(), text_of(parameter), text_of(parameters_json));
    relign_run_outcome told{};
    told.struct_size = static_cast<std::uint32_t>(std::min<std::size_t>(outcome->struct_size, sizeof told));
    const relign_status status = service.run_inner(inner, most_steps, told);
    std::memcpy(outcome, &told, told.struct_size);
    return status;
  });
}

relign_status RunService::run_inner(const plugin_host::Choice& inner, std::uint32_t most_steps,
                                    relign_run_outcome& outcome) {
  Conversation& host = site_->host;
  Seat& outer = site_->seat;
  const TrialSetup& setup = host.setup();
  const unsigned budget = std::min(most_steps, outer.steps_left());
  if (budget == 0 || host.asked_to_stop()) return stop(*site_);

  const Rules rules = make_rules(setup.protocol, *inner.plugin, *setup.instance, *setup.scene);
  const std::uint64_t seed = algorithm_seed(outer.table().task->seed, inner.id, runs_++);
  NestedConversation nested(host, outer, inner, budget, seed, rules.largest_move);
  relign_status status = RELIGN_OK;
  try {
    const LargestMove limit(host, nested.table().task->largest_move);
    plugin_host::Algorithm algorithm(inner, algorithm_services(setup));
    algorithm.run(nested.table());
  } catch (const Error& error) {
    // What the scene or the run's owner threw on the way is not the inner algorithm's failure.
    if (host.host_failed() || error.kind() != ErrorKind::plugin_failed) throw;
    site_->why = error.what();
    status = RELIGN_FAILED;
  }

  outcome.steps = nested.steps();
  const bool finished = !nested.told_to_stop() && nested.steps_left() > 0;
  outcome.end = finished ? RELIGN_RUN_FINISHED : RELIGN_RUN_STEPS_SPENT;
  last_.struct_size = sizeof last_;
  outer.tell(&last_);
  outcome.last = &last_;
  if (outer.table().task->knows & RELIGN_KNOWS_MERIT && !nested.best_pose().empty()) {
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

relign_status RunService::why(void* context, const relign_text_sink* sentence) {
  return tell_why(static_cast<RunService*>(context)->site_, sentence);
}

}  // namespace relign::trials
