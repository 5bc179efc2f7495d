// The methods and groups of page_data, from the trial table and the study.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "report/loaded_results.h"
#include "statistics/study.h"

namespace relign::report {

// The methods: from the manifest, or from the trials if it has no entry. One name may denote several methods: within a
// suite under different protocols, across folders also with different parameters or merit.
class Methods {
 public:
  explicit Methods(const LoadedResults& results);
  const std::vector<Json>& list() const { return list_; }
  const Json& of(const std::string& name, const std::string& protocol) const {
    return list_[places_.at({name, protocol})];
  }

 private:
  void add(Json method);
  std::vector<Json> list_;
  std::map<std::pair<std::string, std::string>, std::size_t> places_;  // by name and protocol
};

// The observation class of a method, within which methods are ranked: "merit", "images", "images and design", "oracle",
// "neither" (observes its own moves only) or "unknown" (not in the manifest).
std::string class_of(const Json& method);
std::string class_title(const std::string& name);  // "Methods that observe images"
// All classes, in the order of the page.
inline constexpr const char* kClasses[] = {"merit", "images", "images and design", "neither", "unknown", "oracle"};

// The classes of these rows or methods.
std::vector<std::string> classes_in(const Json& rows);

// Sets "label" of each method: its name, with the protocol if the name is not unique.
void label_methods(Json& methods);

Json groups_json(const LoadedResults& results, const statistics::Study& study, const Methods& methods);

}  // namespace relign::report
