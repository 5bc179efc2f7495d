#include "report/training_data.h"

#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "base/json_members.h"
#include "report/page_data.h"

namespace relign::report {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Machine and compute time until half of the instances are in specification.
double seconds_to_spec(const Json& row) {
  const Json& arrival = object_of(row, "to_spec");
  if (text_of(arrival, "seconds") == "never" || text_of(arrival, "steps") == "never") return kNever;
  return number_in(arrival, "seconds") + number_in(arrival, "steps") * number_in(row, "algorithm_ms_per_step") / 1000;
}

using Trainings = std::map<std::pair<std::string, std::string>, Json>;  // by method and protocol

// Null if the method is not trained. An entry without a protocol is for all of them.
const Json& training_of(const Trainings& trainings, const std::string& name, const std::string& protocol) {
  static const Json kNothing;
  for (const std::string& key : {protocol, std::string()})
    if (const auto found = trainings.find({name, key}); found != trainings.end()) return found->second;
  return kNothing;
}

// As stated in the manifest, else the images of pretraining on source instances.
Trainings trainings_of(const Json& manifest) {
  Trainings all;
  for (const Json& entry : list_of(manifest, "prepared")) {
    const std::string method = text_of(entry, "algorithm");
    if (method.empty() || !text_of(entry, "failure").empty()) continue;
    const std::uint64_t images = count_of(entry, "sources") * count_of(entry, "steps");
    Json& known = all[{method, text_of(entry, "protocol")}];
    if (known.is_null()) known = {{"hours", nullptr}, {"steps", 0u}, {"machine", ""}};
    known["steps"] = std::max(known["steps"].get<std::uint64_t>(), images);  // of one scene and noise level
  }
  for (const Json& entry : list_of(manifest, "algorithms")) {
    const Json& training = object_of(entry, "training");
    if (training.empty()) continue;
    const double hours = number_in(training, "hours"), steps = number_in(training, "steps");
    all[{text_of(entry, "name"), text_of(entry, "protocol")}] = {
        {"hours", hours >= 0 ? shown_number(hours) : Json()},
        {"steps", steps >= 0 && steps < 1e18 ? Json(std::llround(steps)) : Json()},
        {"machine", text_of(training, "machine")}};
  }
  return all;
}

// The method without training that reaches the specification fastest; oracles are excluded.
const Json* best_untrained(const Json& group, const Trainings& trained) {
  const Json* best = nullptr;
  for (const Json& row : group["rows"]) {
    if (flag_of(row, "oracle") || !training_of(trained, text_of(row, "method"), text_of(group, "protocol")).is_null())
      continue;
    const double seconds = seconds_to_spec(row);
    if (!std::isfinite(seconds)) continue;
    if (!best || seconds < seconds_to_spec(*best)) best = &row;
  }
  return best;
}

Json break_even_data(const Json& data, const std::string& method, const std::string& protocol, double hours,
                     const Trainings& trained) {
  Json list = Json::array();
  for (std::size_t index = 0; index < data["groups"].size(); ++index) {
    const Json& group = data["groups"][index];
    if (!protocol.empty() && text_of(group, "protocol") != protocol) continue;
    const Json* own = nullptr;
    for (const Json& row : group["rows"])
      if (text_of(row, "method") == method) own = &row;
    if (!own || object_of(*own, "to_spec").empty()) continue;
    const Json* other = best_untrained(group, trained);
    const double with = seconds_to_spec(*own), without = other ? seconds_to_spec(*other) : kNever;
    const double lenses = pays_after(hours, with, without);
    Json entry = {{"group", index}, {"label", text_of(group, "label")}};
    entry["lenses"] = std::isinf(lenses) ? Json("never") : shown_number(lenses);
    entry["against"] = other ? text_of(*other, "method") : "";
    entry["saves"] = shown_number(without - with);
    list.push_back(std::move(entry));
  }
  return list;
}

}  // namespace

double pays_after(double hours, double seconds_trained, double seconds_untrained) {
  if (seconds_trained == kNever) return kNever;
  if (std::isnan(hours) || std::isnan(seconds_trained) || !std::isfinite(seconds_untrained))
    return statistics::kMissing;
  const double saved = seconds_untrained - seconds_trained;
  return saved > 0 ? std::ceil(3600 * hours / saved) : kNever;
}

Json training_data(const Json& data, const Json& manifest) {
  const Trainings trained = trainings_of(manifest);
  Json list = Json::array();
  for (const Json& method : data["methods"]) {
    const std::string name = text_of(method, "name"), protocol = text_of(method, "protocol");
    const Json& found = training_of(trained, name, protocol);
    if (found.is_null()) continue;
    Json entry = found;
    entry["method"] = text_of(method, "label");
    entry["pays_after"] = break_even_data(data, name, protocol, number_in(entry, "hours"), trained);
    list.push_back(std::move(entry));
  }
  return list;
}

}  // namespace relign::report
