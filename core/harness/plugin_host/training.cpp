#include "plugin_host/training.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/files.h"
#include "base/json_members.h"

namespace relign::plugin_host {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();
constexpr std::size_t kMaxSideFileBytes = std::size_t{16} << 20;
constexpr std::size_t kMaxMachineLength = 200;

Json amount(const Json& object, const char* key) {
  const Json value = object.is_object() ? object.value(key, Json()) : Json();
  return value.is_number() && std::isfinite(value.get<double>()) && value.get<double>() >= 0 ? value : Json();
}

Json read_facts(const Json& stated) {
  Json facts = {{"hours", amount(stated, "hours")}, {"steps", amount(stated, "steps")}};
  facts["machine"] = text_of(stated, "machine").substr(0, kMaxMachineLength);
  const Json before = amount(object_of(stated, "warm_start"), "hours");
  if (facts["hours"].is_number() && before.is_number())
    facts["hours"] = facts["hours"].get<double>() + before.get<double>();
  return facts;
}

// "training" as it is in the manifest.
Json training_entry(const Manifest& manifest) {
  const Json root = parsed_json(manifest.text);
  return root.is_object() ? root.value("training", Json()) : Json();
}

Json sum(const Json& a, const Json& b) {
  if (!a.is_number() || !b.is_number()) return nullptr;
  if (a.is_number_unsigned() && b.is_number_unsigned()) return a.get<std::uint64_t>() + b.get<std::uint64_t>();
  return a.get<double>() + b.get<double>();
}

}  // namespace

Json side_file_of(const Choice& choice) {
  const Json own = training_entry(*choice.plugin);
  const Parameter* parameter = own.is_string() ? choice.plugin->parameter(own.get<std::string>()) : nullptr;
  if (!parameter || !choice.parameters.is_object()) return nullptr;
  const Json file = choice.parameters.value(parameter->name, Json());
  if (!file.is_string()) return nullptr;
  try {
    const std::filesystem::path side = std::filesystem::path(file.get<std::string>()).replace_extension(".json");
    const Json content = parsed_json(read_file(side, kMaxSideFileBytes));
    return content.is_object() ? content : Json();
  } catch (const Error&) {
    return nullptr;
  }
}

Json training_of(const Choice& choice) {
  Json all;
  const auto add = [&all](const Json& facts) {
    if (!facts.is_object()) return;
    if (all.is_null()) {
      all = facts;
      return;
    }
    for (const char* key : {"hours", "steps"}) all[key] = sum(all[key], facts[key]);
    const std::string known = text_of(all, "machine"), other = text_of(facts, "machine");
    if (known != other) all["machine"] = known.empty() || other.empty() ? known + other : known + ", " + other;
  };
  const Json own = training_entry(*choice.plugin);
  if (own.is_object()) add(read_facts(own));
  if (!training_parameter(*choice.plugin).empty()) add(read_facts(object_of(side_file_of(choice), "trained")));
  for (const auto& [parameter, inner] : choice.algorithms) add(training_of(*inner));
  return all;
}

std::string training_parameter(const Manifest& manifest) {
  const Json own = training_entry(manifest);
  const Parameter* parameter = own.is_string() ? manifest.parameter(own.get<std::string>()) : nullptr;
  return parameter ? parameter->name : "";
}

void check_training(const JsonSource& source, ObjectReader& reader, const Manifest& manifest,
                    std::vector<Problem>& problems) {
  const Json* given = reader.get("training");
  if (!given) return;
  if (!is_algorithm(manifest.kind)) reader.complain("training", "only optimizers and agents are trained");
  if (given->is_string()) {
    const Parameter* parameter = manifest.parameter(given->get<std::string>());
    if (!parameter || parameter->type != ParameterType::file)
      reader.complain("training",
                      "expected the name of a parameter of type file, found '" + given->get<std::string>() + "'");
    return;
  }
  if (!given->is_object()) {
    reader.complain("training", "expected an object with 'hours', 'steps', 'machine', or the name of a file parameter");
    return;
  }
  ObjectReader facts(source, "/training", problems);
  facts.number("hours", 0, 0, kUnlimited);
  facts.integer("steps", 0, 0, std::numeric_limits<std::int64_t>::max());
  facts.string("machine", "");
  facts.reject_unknown();
}

// ---- pretraining ------------------------------------------------------------------------------

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
