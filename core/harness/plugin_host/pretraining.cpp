#include "plugin_host/pretraining.h"

#include <algorithm>

namespace relign::plugin_host {
namespace {

struct Count {
  const char* name;
  unsigned most;
};
constexpr Count kCounts[] = {{"sources", 1000}, {"steps", 100000}};

// A parameter that sets a count must have a valid range.
std::string check_range(const Parameter* parameter, const Count& count) {
  const std::string wanted = "expected an integer from 1 to " + std::to_string(count.most) +
                             ", or the name of an integer parameter with a minimum and a maximum in that range";
  if (!parameter || parameter->type != ParameterType::integer || !parameter->minimum || !parameter->maximum)
    return wanted;
  return *parameter->minimum >= 1 && *parameter->maximum <= count.most ? "" : wanted;
}

unsigned stated_value(const Json& stated, const Json& parameters) {
  return stated.is_string() ? parameters.at(stated.get<std::string>()).get<unsigned>() : stated.get<unsigned>();
}

}  // namespace

std::optional<Pretraining> pretraining(const Manifest& manifest, const Json& parameters) {
  if (manifest.prepare.is_null()) return std::nullopt;
  return Pretraining{stated_value(manifest.prepare.at("sources"), parameters),
                     stated_value(manifest.prepare.at("steps"), parameters)};
}

bool is_prepared(const Choice& choice) {
  return !choice.plugin->prepare.is_null() || std::any_of(choice.algorithms.begin(), choice.algorithms.end(),
                                                          [](const auto& entry) { return is_prepared(*entry.second); });
}

void read_pretraining(const JsonSource& source, ObjectReader& reader, Manifest& manifest,
                      std::vector<Problem>& problems) {
  const Json* stated = reader.get("prepare");
  if (!stated) return;
  if (!is_algorithm(manifest.kind)) reader.complain("prepare", "only optimizers and agents have pretraining");
  if (!stated->is_object()) {
    reader.complain("prepare", "expected an object with 'sources' and 'steps'");
    return;
  }
  ObjectReader counts(source, "/prepare", problems);
  Json checked = Json::object();
  for (const Count& count : kCounts) {
    if (!counts.has(count.name)) {
      counts.complain_missing(count.name, "an integer or the name of a parameter");
      continue;
    }
    const Json* value = counts.get(count.name);
    const Parameter* parameter = value->is_string() ? manifest.parameter(value->get<std::string>()) : nullptr;
    if (value->is_number_integer()) {
      counts.integer(count.name, 1, 1, count.most);
      checked[count.name] = *value;
    } else if (const std::string wrong = check_range(parameter, count); !wrong.empty()) {
      counts.complain(count.name, wrong);
    } else {
      checked[count.name] = parameter->name;
    }
  }
  counts.reject_unknown();
  manifest.prepare = std::move(checked);
}

}  // namespace relign::plugin_host
