#include "report/training_data.h"

#include <limits>
#include <map>

namespace relign::report {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Machine and compute time until half of the instances are in specification.
double seconds_to_spec(const Row& row) {
  const TimeToSpec time = row.to_spec.value_or(TimeToSpec());
  if (std::isinf(time.seconds) || std::isinf(time.steps)) return kNever;
  return time.seconds + time.steps * row.algorithm_ms_per_step / 1000;
}

using Trainings = std::map<std::pair<std::string, std::string>, TrainingCost>;  // by method and protocol

// nullptr if the method is not trained.
const TrainingCost* training_of(const Trainings& trainings, const std::string& name, const std::string& protocol) {
  const auto found = trainings.find({name, protocol});
  return found == trainings.end() ? nullptr : &found->second;
}

// As stated in the manifest, else the images of pretraining on source instances.
Trainings trainings_of(const records::Manifest& manifest) {
  Trainings all;
  for (const records::Pretrained& entry : manifest.prepared) {
    if (!entry.failure.empty()) continue;
    const double images = static_cast<double>(entry.sources) * entry.steps;
    TrainingCost& known = all[{entry.algorithm, entry.protocol}];
    known.steps = std::isnan(known.steps) ? images : std::max(known.steps, images);  // of one scene and noise level
  }
  for (const records::ManifestMethod& entry : manifest.algorithms) {
    if (!entry.training) continue;
    TrainingCost& cost = all[{entry.name, entry.protocol}] = {};
    cost.hours = shown(entry.training->hours);
    if (entry.training->steps < 1e18) cost.steps = std::round(entry.training->steps);
    cost.stated = true;
    cost.machine = entry.training->machine;
  }
  return all;
}

// The method without training that reaches the specification fastest; oracles are excluded.
const Row* best_untrained(const Group& group, const Trainings& trained) {
  const Row* best = nullptr;
  for (const Row& row : group.rows) {
    if (row.oracle() || training_of(trained, row.method, group.protocol)) continue;
    const double seconds = seconds_to_spec(row);
    if (!std::isfinite(seconds)) continue;
    if (!best || seconds < seconds_to_spec(*best)) best = &row;
  }
  return best;
}

// By the costs of a good module at the number of images of least cost.
double modules_until_paid(const Prices& prices, const Row& row, double hours) {
  if (row.costs.empty() || row.costs.back().saves.n == 0) return kMissing;
  const double saves = row.costs.back().saves.estimate;
  return saves > 0 ? std::ceil(hours * prices.training_per_hour / saves) : kNever;
}

std::vector<BreakEven> break_evens(const std::vector<Group>& groups, const Method& method, double hours,
                                   const Trainings& trained) {
  std::vector<BreakEven> list;
  for (std::size_t index = 0; index < groups.size(); ++index) {
    const Group& group = groups[index];
    if (!method.protocol.empty() && group.protocol != method.protocol) continue;
    const Row* own = nullptr;
    for (const Row& row : group.rows)
      if (row.method == method.name) own = &row;
    if (!own || !own->to_spec) continue;
    const Row* other = best_untrained(group, trained);
    const double with = seconds_to_spec(*own), without = other ? seconds_to_spec(*other) : kNever;
    list.push_back({index, group.label, shown_arrival(pays_after(hours, with, without)), other ? other->method : "",
                    shown(without - with), modules_until_paid(group.prices, *own, hours)});
  }
  return list;
}

}  // namespace

double pays_after(double hours, double seconds_trained, double seconds_untrained) {
  if (seconds_trained == kNever) return kNever;
  if (std::isnan(hours) || std::isnan(seconds_trained) || !std::isfinite(seconds_untrained)) return kMissing;
  const double saved = seconds_untrained - seconds_trained;
  return saved > 0 ? std::ceil(3600 * hours / saved) : kNever;
}

std::vector<TrainingCost> training_costs(const records::Manifest& manifest, const std::vector<Method>& methods,
                                         const std::vector<Group>& groups) {
  const Trainings trained = trainings_of(manifest);
  std::vector<TrainingCost> list;
  for (const Method& method : methods) {
    const TrainingCost* found = training_of(trained, method.name, method.protocol);
    if (!found) continue;
    list.push_back(*found);
    list.back().method = method.label;
    list.back().pays_after = break_evens(groups, method, found->hours, trained);
  }
  return list;
}

}  // namespace relign::report
