// The methods and groups of page_data.h, from the trial table and the study.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "report/loaded_results.h"
#include "stats/study.h"

namespace relign::report {

// The manifest's entry of a method shown under this name, else what its trials tell.
class Methods {
 public:
  explicit Methods(const LoadedResults& results);
  const std::vector<Json>& list() const { return list_; }
  const Json& operator[](const std::string& name) const { return list_[by_name_.at(name)]; }

 private:
  void add(Json method);
  std::vector<Json> list_;
  std::map<std::string, std::size_t> by_name_;
};

Json groups_json(const LoadedResults& results, const stats::Study& study, const Methods& methods);

}  // namespace relign::report
