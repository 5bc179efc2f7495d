// The methods and groups of page_data.h, from the trial table and the study.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "report/loaded_results.h"
#include "statistics/study.h"

namespace relign::report {

// The manifest's entry of a method, else what its trials tell. One name may stand for several methods: of a suite those
// under different protocols, of several folders also those with other parameters or another merit.
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

// What a method observes, for nobody ranks across privileges: "merit", "images", "images and design", "oracle";
// "neither" observes no more than its own moves, "unknown" is of folders that do not name it.
std::string class_of(const Json& method);
// Those that there can be, in the order of the page.
std::string class_title(const std::string& name);  // "Methods that observe images"
inline constexpr const char* kClasses[] = {"merit", "images", "images and design", "neither", "unknown", "oracle"};

// Those that the rows, or methods, have.
std::vector<std::string> classes_in(const Json& rows);

// Sets each method's "label": its name, with its protocol where the name alone is not one method.
void label_methods(Json& methods);

Json groups_json(const LoadedResults& results, const statistics::Study& study, const Methods& methods);

}  // namespace relign::report
