#include "report/methods.h"

#include <algorithm>
#include <set>

#include "base/hash.h"
#include "base/json_members.h"

namespace relign::report {
namespace {

struct ClassWords {
  ObservationClass of_class;
  const char *name, *title;
};
constexpr ClassWords kClassWords[] = {
    {ObservationClass::merit, "merit", "Methods that observe the merit alone"},
    {ObservationClass::images, "images", "Methods that observe images"},
    {ObservationClass::images_and_design, "images and design", "Methods that observe images and the design"},
    {ObservationClass::neither, "neither", "Methods that observe neither images nor the merit"},
    {ObservationClass::oracle, "oracle", "Oracles"},
    {ObservationClass::unknown, "unknown", "Methods whose observations the manifest does not list"}};

const ClassWords& words_of(ObservationClass of_class) {
  for (const ClassWords& words : kClassWords)
    if (words.of_class == of_class) return words;
  return std::end(kClassWords)[-1];
}

ObservationClass class_of(const std::vector<std::string>& observes) {
  const auto has = [&](const char* what) {
    return std::find(observes.begin(), observes.end(), what) != observes.end();
  };
  if (has("images"))
    return has("design") || has("level") ? ObservationClass::images_and_design : ObservationClass::images;
  return has("merit") ? ObservationClass::merit : ObservationClass::neither;
}

Method described(const Json& entry) {
  Method method;
  method.name = text_of(entry, "name");
  method.id = text_of(entry, "id");
  method.kind = text_of(entry, "kind");
  method.merit = text_of(entry, "merit");
  method.summary = text_of(entry, "summary");
  method.reproducible = text_of(entry, "reproducible");
  method.plugin_hash = text_of(entry, "plugin_hash");
  for (const Json& observed : list_of(entry, "observes"))
    if (observed.is_string()) method.observes.push_back(observed);
  method.of_class = flag_of(entry, "oracle")      ? ObservationClass::oracle
                    : !entry.contains("observes") ? ObservationClass::unknown
                                                  : class_of(method.observes);
  method.steps = count_of(entry, "steps");
  method.parameters = object_of(entry, "parameters");
  return method;
}

}  // namespace

const char* class_name(ObservationClass of_class) { return words_of(of_class).name; }

std::string class_title(ObservationClass of_class) { return words_of(of_class).title; }

std::vector<std::string> observed_words(const Method& method, bool start_is_observed) {
  std::vector<std::string> names = method.observes;
  if (!start_is_observed && method.of_class != ObservationClass::oracle) std::erase(names, "start");
  return names;
}

Methods::Methods(const LoadedResults& results) {
  const std::map<std::string, std::string> tags = training_tags(results.manifest);
  for (const Json& entry : list_of(results.manifest, "algorithms")) {
    Method method = described(entry);
    std::set<std::string> protocols = {text_of(entry, "protocol")};
    if (protocols.count("") > 0)  // without a protocol: that of its trials
      for (const statistics::Series& series : results.trials.series)
        if (series.algorithm == method.name) protocols.insert(series.protocol);
    if (protocols.size() > 1) protocols.erase("");
    if (const auto tag = tags.find(method.name); tag != tags.end()) method.training_tag = tag->second;
    for (const std::string& protocol : protocols) {
      if (method.name.empty() || places_.count({method.name, protocol}) > 0) continue;
      method.protocol = protocol;
      add(method);
    }
  }
  for (const statistics::Series& series : results.trials.series) {
    if (places_.count({series.algorithm, series.protocol}) > 0) continue;
    Method method;
    method.in_manifest = false;
    method.name = series.algorithm;
    method.id = series.algorithm_id;
    method.protocol = series.protocol;
    if (series.algorithm_id == "home" && series.protocol == "blind") method.of_class = ObservationClass::oracle;
    method.steps = series.largest_budget;
    if (const auto tag = tags.find(method.name); tag != tags.end()) method.training_tag = tag->second;
    add(std::move(method));
  }
}

void Methods::add(Method method) {
  method.key = short_hash(canonical_json({{"name", method.name},
                                          {"id", method.id},
                                          {"protocol", method.protocol},
                                          {"merit", method.merit},
                                          {"parameters", method.parameters}}));
  places_[{method.name, method.protocol}] = list_.size();
  list_.push_back(std::move(method));
}

void label_methods(std::vector<Method>& methods) {
  std::map<std::string, std::size_t> uses;
  for (const Method& method : methods) ++uses[method.name];
  for (Method& method : methods)
    method.label = uses[method.name] > 1 ? method.name + " (" + method.protocol + ")" : method.name;
}

std::string label_of(const std::vector<Method>& methods, const std::string& name, const std::string& protocol) {
  for (const Method& method : methods)
    if (method.name == name && method.protocol == protocol) return method.label;
  return name;
}

std::map<std::string, std::string> training_tags(const Json& manifest) {
  std::map<std::string, std::set<std::string>> trainings;  // sets: a method may run under both protocols
  for (const Json& entry : list_of(manifest, "algorithms"))
    if (const Json& list = object_of(entry, "of_list"); !list.empty())
      trainings[text_of(list, "method")].insert(text_of(list, "training"));
  std::map<std::string, std::string> tags;
  for (const Json& entry : list_of(manifest, "algorithms")) {
    const Json& list = object_of(entry, "of_list");
    const std::string name = text_of(entry, "name"), method = text_of(list, "method");
    const std::size_t count = list.empty() ? 0 : trainings[method].size();
    if (count > 1) {
      tags[name] = "1 of " + std::to_string(count) + " training runs";
      tags[method] = std::to_string(count) + " training runs";
    } else if (count == 1 || !object_of(entry, "training").empty()) {
      tags[name] = kOneTraining;
      if (count == 1) tags[method] = kOneTraining;
    }
  }
  return tags;
}

std::string training_tag(const std::vector<Method>& methods, const std::string& name) {
  for (const Method& method : methods)
    if (method.name == name) return method.training_tag;
  return "";
}

}  // namespace relign::report
