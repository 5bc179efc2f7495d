#include "report/methods.h"

#include <algorithm>
#include <set>

#include "base/hash.h"

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

Method described(const records::ManifestMethod& entry) {
  Method method;
  method.name = entry.name;
  method.id = entry.id;
  method.kind = entry.kind;
  method.protocol = entry.protocol;
  method.merit = entry.merit;
  method.summary = entry.summary;
  method.reproducible = entry.reproducible;
  method.plugin_hash = entry.plugin_hash;
  method.observes = entry.observes;
  method.of_class = entry.oracle ? ObservationClass::oracle : class_of(method.observes);
  method.steps = entry.steps;
  method.parameters = entry.parameters;
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
  for (const records::ManifestMethod& entry : results.manifest.algorithms) {
    Method method = described(entry);
    if (const auto tag = tags.find(method.name); tag != tags.end()) method.training_tag = tag->second;
    add(std::move(method));
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

std::map<std::string, std::string> training_tags(const records::Manifest& manifest) {
  std::map<std::string, std::set<std::string>> trainings;  // sets: a method may run under both protocols
  for (const records::ManifestMethod& entry : manifest.algorithms)
    if (entry.of_list) trainings[entry.of_list->method].insert(entry.of_list->training);
  std::map<std::string, std::string> tags;
  for (const records::ManifestMethod& entry : manifest.algorithms) {
    const std::size_t count = entry.of_list ? trainings[entry.of_list->method].size() : 0;
    if (count > 1) {
      tags[entry.name] = "1 of " + std::to_string(count) + " training runs";
      tags[entry.of_list->method] = std::to_string(count) + " training runs";
    } else if (count == 1 || entry.training) {
      tags[entry.name] = kOneTraining;
      if (count == 1) tags[entry.of_list->method] = kOneTraining;
    }
  }
  return tags;
}

std::map<std::string, std::string> training_lists(const records::Manifest& manifest) {
  std::map<std::string, std::string> lists;
  for (const records::ManifestMethod& entry : manifest.algorithms)
    if (entry.of_list) lists[entry.name] = entry.of_list->method;
  return lists;
}

std::string training_tag(const std::vector<Method>& methods, const std::string& name) {
  for (const Method& method : methods)
    if (method.name == name) return method.training_tag;
  return "";
}

}  // namespace relign::report
