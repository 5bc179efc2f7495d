#include "report/rules_data.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "base/json_members.h"
#include "report/page_data.h"
#include "report/page_groups.h"
#include "report/statistics_data.h"
#include "report/verdict_cases.h"

namespace relign::report {
namespace {

Json score_json(const statistics::RuleScore& score) {
  Json json = {{"n", score.median.n}};
  if (score.median.n == 0) return json;
  json["median"] = shown_number(score.median.estimate);
  json["lo95"] = shown_number(score.median.interval.low);
  json["hi95"] = shown_number(score.median.interval.high);
  if (score.yield.n > 0)
    json["yield"] = {{"in", score.in_spec},
                     {"n", score.yield.n},
                     {"share", shown_number(score.yield.estimate)},
                     {"lo95", shown_number(score.yield.interval.low)},
                     {"hi95", shown_number(score.yield.interval.high)}};
  const double steps = score.steps_to_spec.estimate;
  if (!std::isnan(steps)) json["steps"] = std::isinf(steps) ? Json("never") : shown_number(steps);
  return json;
}

const Json& rule_of(const Json& row, const std::string& rule) {
  return object_of(object_of(row, "rules"), rule.c_str());
}

// The two methods with the lowest medians by the rule in each class, and their comparison.
Json leads_of(const Json& group, const std::string& rule, const Json& pairs) {
  Json leads = Json::array();
  for (const std::string name : kClasses) {
    if (name == "oracle") continue;
    std::vector<const Json*> ranked;
    for (const Json& row : group["rows"])
      if (text_of(row, "class") == name && member(rule_of(row, rule), "median").is_number()) ranked.push_back(&row);
    if (ranked.empty()) continue;
    std::stable_sort(ranked.begin(), ranked.end(), [&](const Json* a, const Json* b) {
      return rule_of(*a, rule)["median"].get<double>() < rule_of(*b, rule)["median"].get<double>();
    });
    Json lead = {{"class", name}, {"best", text_of(*ranked[0], "method")}};
    if (ranked.size() > 1) lead["next"] = text_of(*ranked[1], "method");
    for (const Json& pair : pairs) {
      if (ranked.size() < 2) break;
      const bool same = pair["a"] == lead["best"] && pair["b"] == lead["next"];
      if (!same && !(pair["b"] == lead["best"] && pair["a"] == lead["next"])) continue;
      const Json found = same ? pair : turned(pair);
      for (const char* key : {"n", "ratio", "lo95", "hi95", "verdict"}) lead[key] = found[key];
      for (const char* key : {"ratio", "lo95", "hi95"})
        if (lead[key].is_number()) lead[key] = shown_number(lead[key].get<double>());
    }
    leads.push_back(std::move(lead));
  }
  return leads;
}

// Rules with scores in the group.
std::vector<std::string> recorded_rules(const Json& group) {
  std::vector<std::string> rules;
  for (const statistics::Rule rule : statistics::kRules)
    if (std::any_of(group["rows"].begin(), group["rows"].end(),
                    [&](const Json& row) { return count_of(rule_of(row, statistics::rule_name(rule)), "n") > 0; }))
      rules.emplace_back(statistics::rule_name(rule));
  return rules;
}

// "images: bo-gp by own (better than random), imitation by best and current (undecided against bo-gp)"; empty if all
// rules agree.
std::string differing_leads(const Json& group, const std::vector<std::string>& rules) {
  std::string words;
  for (const std::string name : kClasses) {
    struct Lead {
      std::string method, verdict, rules;
    };
    std::vector<Lead> found;
    for (const std::string& rule : rules)
      for (const Json& lead : list_of(object_of(object_of(group, "rules"), rule.c_str()), "leads")) {
        if (text_of(lead, "class") != name) continue;
        const std::string verdict = text_of(lead, "verdict");
        const std::string method = text_of(lead, "best"), next = text_of(lead, "next");
        const std::string text = verdict == "better"              ? " (better than " + next + ")"
                                 : verdict == "practically equal" ? " (practically equal to " + next + ")"
                                 : verdict == "undecided"         ? " (undecided against " + next + ")"
                                 : verdict == "worse"             ? " (lower median, but worse than " + next + ")"
                                                                  : "";
        const auto same = std::find_if(found.begin(), found.end(),
                                       [&](const Lead& one) { return one.method == method && one.verdict == text; });
        if (same == found.end())
          found.push_back({method, text, rule});
        else
          same->rules += " and " + rule;
      }
    if (found.size() < 2) continue;
    words += words.empty() ? "" : "; ";
    if (name != "unknown") words += name + ": ";
    for (std::size_t i = 0; i < found.size(); ++i)
      words += (i ? ", " : "") + found[i].method + " by " + found[i].rules + found[i].verdict;
  }
  return words;
}

}  // namespace

std::string rules_note(const Json& data) {
  constexpr std::size_t kMaxGroups = 6;
  std::vector<std::string> differing;
  bool all_recorded = true, any = false;
  for (const Json& group : data["groups"]) {
    if (flag_of(group, "measured_only") || object_of(group, "rules").empty()) continue;
    any = true;
    const std::vector<std::string> rules = recorded_rules(group);
    all_recorded = all_recorded && rules.size() == statistics::kRules.size();
    if (const std::string words = differing_leads(group, rules); !words.empty())
      differing.push_back(text_of(group, "label") + ": " + words);
  }
  if (!any) return "";
  std::string note;
  if (differing.empty()) {
    note = all_recorded ? "No verdict depends on the recommendation rule: by own, best and current the same method of "
                          "each class has the lowest median, with the same verdict against the second."
                        : "Whether a verdict depends on the recommendation rule is unknown.";
  } else {
    note = "The verdict depends on the recommendation rule. ";
    for (std::size_t i = 0; i < std::min(differing.size(), kMaxGroups); ++i) note += (i ? ". " : "") + differing[i];
    note +=
        differing.size() > kMaxGroups ? "; and in " + std::to_string(differing.size() - kMaxGroups) + " more." : ".";
  }
  if (!all_recorded)
    note +=
        " Some trials were recorded by an earlier version and lack scores for the rules best and current; "
        "'relign-bench verify DIR --add-rules' adds them.";
  return note;
}

void add_rules(Json& data, const LoadedResults& results, const statistics::Study& study) {
  const double relevant = data["smallest_relevant_ratio"].get<double>();
  for (Json& group : data["groups"]) {
    if (flag_of(group, "measured_only")) continue;
    for (const statistics::GroupStudy& found : study.groups) {
      if (found.scene != text_of(group, "scene") || found.noise_level != text_of(group, "noise_level") ||
          found.protocol != text_of(group, "protocol"))
        continue;
      for (Json& row : group["rows"])
        for (const std::size_t series : found.series)
          if (study.series[series].curve.algorithm == text_of(row, "method"))
            for (const statistics::Rule rule : statistics::kRules)
              row["rules"][statistics::rule_name(rule)] = score_json(study.series[series].rules[rule]);
      for (const statistics::Rule rule : statistics::kRules) {
        Json pairs = Json::array();
        for (const statistics::PairStudy& pair : found.pairs_by_rule[rule])
          pairs.push_back(pair_json(pair, study, relevant));
        Json leads = leads_of(group, statistics::rule_name(rule), pairs);
        group["rules"][statistics::rule_name(rule)] = {{"pairs", std::move(pairs)}, {"leads", std::move(leads)}};
      }
    }
  }
  if (results.trials.without_rules > 0) data["trials_without_rules"] = results.trials.without_rules;
  if (std::string note = rules_note(data); !note.empty()) data["rules_note"] = std::move(note);
}

void add_analysis(Json& data, const Json& manifest) {
  const Json& plan = object_of(manifest, "analysis");
  const std::string began = text_of(manifest, "analysis_began_with");
  if (plan.empty() && began.empty()) return;
  Json notes = Json::array();
  if (!began.empty())
    notes.push_back(
        began == "none" ? "The analysis plan was written after the first trials had ended and is not a prior plan."
        : plan.empty()
            ? "The run began with the analysis plan " + began.substr(0, 16) + ", which was removed later."
            : "The analysis plan was changed after the first trials had ended; the run began with the plan " +
                  began.substr(0, 16) + ".");
  if (!plan.empty()) {
    data["analysis"] = plan;
    data["analysis"]["hash"] = text_of(manifest, "analysis_hash");
    if (text_of(plan, "rule") != text_of(data, "rule"))
      notes.push_back("This page uses the rule '" + text_of(data, "rule") + "', the analysis plan the rule '" +
                      text_of(plan, "rule") + "'.");
  }
  data["analysis_notes"] = std::move(notes);
}

const char* rule_text(const std::string& rule) {
  return rule == "best"      ? "the pose with the lowest measured error"
         : rule == "current" ? "the current pose"
                             : "the pose recommended by the method";
}

}  // namespace relign::report
