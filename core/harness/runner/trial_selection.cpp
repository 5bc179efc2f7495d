#include "runner/trial_selection.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "base/error.h"
#include "base/text.h"

namespace relign::runner {
namespace {

// The keys of `only`.
const std::vector<std::string> kOnlyKeys = {"scene", "noise_level", "algorithm", "protocol", "instance"};

std::string answer(const suites::Suite& suite, const suites::PlannedTrial& trial, const std::string& key) {
  if (key == "scene") return suite.scenes[trial.scene].name;
  if (key == "noise_level") return suite.levels[trial.level].name;
  if (key == "algorithm") return suite.algorithms[trial.algorithm].name;
  if (key == "protocol") return suite.algorithms[trial.algorithm].protocol;
  return std::to_string(trial.instance);
}

}  // namespace

std::vector<std::size_t> select_trials(const suites::Plan& plan,
                                       const std::vector<std::pair<std::string, std::string>>& only) {
  std::map<std::string, std::set<std::string>> wanted;
  for (const auto& [given_key, given_value] : only) {
    const std::string& value = given_value;  // lambdas cannot capture structured bindings
    std::string key = given_key;
    std::replace(key.begin(), key.end(), '-', '_');
    if (std::find(kOnlyKeys.begin(), kOnlyKeys.end(), key) == kOnlyKeys.end())
      throw Error(ErrorKind::bad_input, "--only " + given_key + "=" + value + ": unknown key '" + given_key + "'" +
                                            suggestion(key, kOnlyKeys));
    std::vector<std::string> known;
    for (const suites::PlannedTrial& trial : plan.trials) {
      const std::string name = answer(plan.suite, trial, key);
      if (std::find(known.begin(), known.end(), name) == known.end()) known.push_back(name);
    }
    const bool found = std::any_of(known.begin(), known.end(), [&value](const std::string& name) {
      return normalised_name(name) == normalised_name(value);
    });
    if (!found) {
      const std::string hint =
          key == "instance" ? "; the plan has " + known.front() + " to " + known.back() : suggestion(value, known);
      throw Error(ErrorKind::bad_input,
                  "--only " + given_key + "=" + value + ": the suite has no " + key + " '" + value + "'" + hint);
    }
    wanted[key].insert(normalised_name(value));
  }
  std::vector<std::size_t> places;
  for (std::size_t place = 0; place < plan.trials.size(); ++place) {
    const bool fits = std::all_of(wanted.begin(), wanted.end(), [&](const auto& key_and_values) {
      return key_and_values.second.count(
                 normalised_name(answer(plan.suite, plan.trials[place], key_and_values.first))) > 0;
    });
    if (fits) places.push_back(place);
  }
  return places;
}

std::vector<std::vector<std::size_t>> group_by_instance(const suites::Plan& plan,
                                                        const std::vector<std::size_t>& places) {
  std::map<std::tuple<std::size_t, std::size_t, std::uint64_t>, std::vector<std::size_t>> groups;
  for (std::size_t position = 0; position < places.size(); ++position) {
    const suites::PlannedTrial& trial = plan.trials[places[position]];
    groups[{trial.scene, trial.level, trial.instance}].push_back(position);
  }
  std::vector<std::vector<std::size_t>> ordered;
  for (auto& [key, positions] : groups) ordered.push_back(std::move(positions));
  return ordered;
}

}  // namespace relign::runner
