#include "report/verdict.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "base/text.h"
#include "report/loaded_results.h"

namespace relign::report {
namespace {

constexpr int kDigits = 3;

std::string shown(const Json& number) { return number.is_number() ? significant(number.get<double>(), kDigits) : "-"; }

std::string counted(std::uint64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

bool ranges_overlap(const Json& a, const Json& b) {
  return a["recommended"]["q25"].get<double>() <= b["recommended"]["q75"].get<double>() &&
         b["recommended"]["q25"].get<double>() <= a["recommended"]["q75"].get<double>();
}

// Rows with a median, oracles apart: who is told the answer cannot win.
struct Ranked {
  explicit Ranked(const Json& group) {
    for (const Json& row : group["rows"]) {
      if (row["recommended"]["n"] == 0) continue;
      (flag_of(row, "oracle") ? oracles : methods).push_back(&row);
    }
  }
  std::vector<const Json*> methods, oracles;
};

std::string failures_of(const Json& row) {
  const std::uint64_t failed = count_of(row, "failed");
  if (failed == 0) return "";
  return " (" + std::to_string(failed) + " of its " + std::to_string(failed + count_of(row, "trials")) +
         " trials failed and do not count in this median)";
}

std::string sentence(const Json& group, const Ranked& ranked) {
  if (ranked.methods.empty()) {
    if (!ranked.oracles.empty()) return "only an oracle has finished; nothing can be ranked.";
    const bool any_trial = std::any_of(group["rows"].begin(), group["rows"].end(),
                                       [](const Json& row) { return count_of(row, "trials") > 0; });
    return any_trial ? "no noise-free error was recorded (a station cannot give one); nothing can be ranked by it."
                     : "every trial failed; nothing can be ranked.";
  }
  const Json& best = *ranked.methods.front();
  const std::uint64_t n = best["recommended"]["n"].get<std::uint64_t>();
  std::string text = text_of(best, "method") + " ends with the lowest ";
  text += n == 1 ? "error, " + shown(best["recommended"]["median"]) + " on its only instance"
                 : "median error, " + shown(best["recommended"]["median"]) + " over " + counted(n, "instance") +
                       " (quartiles " + shown(best["recommended"]["q25"]) + " to " + shown(best["recommended"]["q75"]) +
                       ")";
  text += failures_of(best);
  if (group["start"].is_number()) text += "; at the start it was " + shown(group["start"]);
  text += ". ";
  if (ranked.methods.size() > 1) {
    const Json& next = *ranked.methods[1];
    const bool level = shown(next["recommended"]["median"]) == shown(best["recommended"]["median"]);
    text += level ? text_of(next, "method") + " ends level with it"
                  : "Next is " + text_of(next, "method") + " with " + shown(next["recommended"]["median"]);
    text += failures_of(next);
    const bool both_spread = n > 1 && next["recommended"]["n"].get<std::uint64_t>() > 1;
    if (both_spread)
      text += ranges_overlap(best, next) ? "; their quartile ranges overlap" : "; their quartile ranges do not overlap";
    text += ". ";
  } else {
    text += "No other method has a result here. ";
  }
  for (const Json* oracle : ranked.oracles)
    text += text_of(*oracle, "method") + ", which is told the design pose, reaches " +
            shown((*oracle)["recommended"]["median"]) + ". ";
  text.pop_back();
  return text;
}

}  // namespace

Json verdict(const Json& data) {
  Json list = Json::array();
  for (const Json& group : data["groups"]) {
    const Ranked ranked(group);
    list.push_back({{"label", group["label"]},
                    {"best", ranked.methods.empty() ? "" : text_of(*ranked.methods.front(), "method")},
                    {"text", sentence(group, ranked)}});
  }
  return list;
}

Json beware(const Json& data) {
  Json list = Json::array();
  const Json& ran = data["ran"];
  const std::uint64_t failed = count_of(ran, "failed"), missing = count_of(ran, "missing");
  if (missing > 0)
    list.push_back(counted(missing, "trial") + " of " + std::to_string(count_of(ran, "planned")) +
                   " not finished: this is a partial result, and every number below may still move.");
  if (failed > 0)
    list.push_back(counted(failed, "trial") +
                   " failed. Failed trials are left out of medians and curves, which flatters " +
                   "a method that fails on hard instances; their number stands in the table.");

  std::set<std::string> oracles;
  bool home_told_start = false, uneven = false, uneven_steps = false;
  std::uint64_t fewest = 0;
  for (const Json& group : data["groups"]) {
    uneven = uneven || !flag_of(group, "same_instances");
    const std::uint64_t instances = count_of(group, "instances");
    fewest = fewest == 0 ? instances : std::min(fewest, instances);
    for (const Json& row : group["rows"]) {
      if (flag_of(row, "oracle")) oracles.insert(text_of(row, "method"));
      if (!flag_of(row, "oracle") && text_of(row, "method") == "home") home_told_start = true;
      if (row["step"] != group["rows"].front()["step"]) uneven_steps = true;
    }
  }
  if (uneven)
    list.push_back("Not every method has finished the same instances, so some medians are over different lenses.");
  if (uneven_steps) list.push_back("Methods were given different numbers of steps; see the column 'steps'.");
  for (const std::string& oracle : oracles)
    list.push_back(oracle + " is an oracle: it is told the design pose, which no method may know under the blind " +
                   "protocol. It shows what that knowledge is worth and is not ranked.");
  if (home_told_start)
    list.push_back(
        "home only moves once, to the nominal pose, which it may know under the paper protocol: nearly the " +
        std::string("answer where lenses and stage are nearly perfect, worthless where they are not."));
  if (count_of(ran, "finished") > 0) {
    list.push_back(fewest == 1
                       ? "A single instance says how one lens went, nothing about the next one."
                       : "Bands and brackets are quartiles (the middle half of the instances), not confidence " +
                             std::string("intervals. No test of significance has been made") +
                             (fewest < 60 ? ", and " + std::to_string(fewest) + " instances are few." : "."));
  }
  return list;
}

}  // namespace relign::report
