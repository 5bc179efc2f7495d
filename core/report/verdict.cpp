#include "report/verdict.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "base/json_members.h"
#include "base/text.h"
#include "report/page_data.h"

namespace relign::report {
namespace {

constexpr int kDigits = 3;

std::string shown(const Json& number) { return number.is_number() ? significant(number.get<double>(), kDigits) : "-"; }

std::string counted(std::uint64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

bool ranges_overlap(const Json& a, const Json& b) {
  return score_of(a)["q25"].get<double>() <= score_of(b)["q75"].get<double>() &&
         score_of(b)["q25"].get<double>() <= score_of(a)["q75"].get<double>();
}

// Rows with a median, oracles apart: who is told the answer cannot win.
struct Ranked {
  explicit Ranked(const Json& group) {
    for (const Json& row : group["rows"]) {
      if (score_of(row)["n"] == 0) continue;
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
    return any_trial ? "no error was recorded, neither measured nor noise-free; nothing can be ranked."
                     : "every trial failed; nothing can be ranked.";
  }
  const Json& best = *ranked.methods.front();
  const Json& score = score_of(best);
  const bool measured_only = flag_of(group, "measured_only");
  const std::string error = measured_only ? "measured error" : "error";
  const std::uint64_t n = score["n"].get<std::uint64_t>();
  std::string text = text_of(best, "method") + " ends with the lowest ";
  text += n == 1 ? error + ", " + shown(score["median"]) + " on its only instance"
                 : "median " + error + ", " + shown(score["median"]) + " over " + counted(n, "instance") +
                       " (quartiles " + shown(score["q25"]) + " to " + shown(score["q75"]) + ")";
  text += failures_of(best);
  if (group["start"].is_number()) text += "; at the start it was " + shown(group["start"]);
  text += ". ";
  if (ranked.methods.size() > 1) {
    const Json& next = *ranked.methods[1];
    const bool level = shown(score_of(next)["median"]) == shown(score["median"]);
    text += level ? text_of(next, "method") + " ends level with it"
                  : "Next is " + text_of(next, "method") + " with " + shown(score_of(next)["median"]);
    text += failures_of(next);
    const bool both_spread = n > 1 && score_of(next)["n"].get<std::uint64_t>() > 1;
    if (both_spread)
      text += ranges_overlap(best, next) ? "; their quartile ranges overlap" : "; their quartile ranges do not overlap";
    text += ". ";
  } else {
    text += "No other method has a result here. ";
  }
  for (const Json* oracle : ranked.oracles)
    text += text_of(*oracle, "method") + ", which is told the design pose, reaches " +
            shown(score_of(*oracle)["median"]) + ". ";
  if (measured_only)
    text += flag_of(group, "station") ? "Measured only: a station tells no truth. "
                                      : "Measured only: this scene tells no truth. ";
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
  bool home_told_start = false, uneven = false, uneven_steps = false, station = false, measured_only = false;
  std::uint64_t fewest = 0;
  for (const Json& group : data["groups"]) {
    uneven = uneven || !flag_of(group, "same_instances");
    station = station || flag_of(group, "station");
    measured_only = measured_only || flag_of(group, "measured_only");
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
  if (measured_only)
    list.push_back(
        "Where it says measured only, the error is the lowest RMSE that the camera saw, its noise included: the best "
        "of "
        "many looks, which flatters a method that looks often. Unknown are the true poses, the error without noise, "
        "and "
        "what gluing at the recommended pose would give.");
  if (station)
    list.push_back(
        "A station's trials cannot be replayed: its lenses, start and stage are its own and differ from trial to trial "
        "in ways that nobody knows. home, which must be told the true start, is left out there.");
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
