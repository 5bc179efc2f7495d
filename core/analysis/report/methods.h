// The methods of a report: from the manifest, or from the trials if it has no entry.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "report/loaded_results.h"

namespace relign::report {

// What a method observes. Methods are ranked within their class.
enum class ObservationClass {
  merit,
  images,
  images_and_design,
  neither,  // its own moves only
  unknown,  // the manifest does not list its observations
  oracle    // not ranked
};
// In the order of the page.
inline constexpr std::array kClasses = {
    ObservationClass::merit,   ObservationClass::images,  ObservationClass::images_and_design,
    ObservationClass::neither, ObservationClass::unknown, ObservationClass::oracle};
const char* class_name(ObservationClass of_class);   // "images and design", as in files
std::string class_title(ObservationClass of_class);  // "Methods that observe images"

// The classes of these rows or methods.
template <class Rows>
std::vector<ObservationClass> classes_in(const Rows& rows) {
  std::vector<ObservationClass> classes;
  for (const ObservationClass one : kClasses)
    for (const auto& row : rows)
      if (row.of_class == one) {
        classes.push_back(one);
        break;
      }
  return classes;
}

struct Method {
  std::string name;
  std::string label;  // unique on the page: with the protocol if the name is not unique
  std::string id, protocol;
  std::string merit;         // "" if unknown
  std::string key;           // hash of name, id, protocol, merit and parameters
  std::string training_tag;  // kOneTraining, "1 of 3 training runs"; "" if not trained
  bool in_manifest = true;   // which has the next line
  std::string kind, summary, reproducible, plugin_hash;
  std::vector<std::string> observes;
  ObservationClass of_class = ObservationClass::unknown;
  std::uint64_t steps = 0;
  Json parameters = Json::object();
};

// What the method observed in its trials: as in the manifest, but without the start if the protocol withholds it.
std::vector<std::string> observed_words(const Method& method, bool start_is_observed);

inline constexpr const char* kOneTraining = "one training run";

// One name may denote several methods: within a suite under different protocols, across folders also with different
// parameters or merit.
class Methods {
 public:
  explicit Methods(const LoadedResults& results);
  const std::vector<Method>& list() const { return list_; }
  const Method& of(const std::string& name, const std::string& protocol) const {
    return list_[places_.at({name, protocol})];
  }

 private:
  void add(Method method);
  std::vector<Method> list_;
  std::map<std::pair<std::string, std::string>, std::size_t> places_;  // by name and protocol
};

void label_methods(std::vector<Method>& methods);

// The label of a method, by its name in the rows of groups with this protocol; the name if unknown.
std::string label_of(const std::vector<Method>& methods, const std::string& name, const std::string& protocol);

// Training tags by display name, and by the name of a method with several trainings.
std::map<std::string, std::string> training_tags(const records::Manifest& manifest);

// From the name of a training to that of its list, the method in the suite.
std::map<std::string, std::string> training_lists(const records::Manifest& manifest);

// The tag of the method with this name, "" if it is not trained.
std::string training_tag(const std::vector<Method>& methods, const std::string& name);

}  // namespace relign::report
