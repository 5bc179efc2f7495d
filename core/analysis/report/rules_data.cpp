#include "report/rules_data.h"

#include <algorithm>
#include <cmath>

#include "base/json_members.h"
#include "report/statistics_data.h"
#include "report/verdict_cases.h"

namespace relign::report {
namespace {

RuleScore rule_score(const statistics::RuleScore& from) {
  RuleScore score;
  if (from.median.n == 0) return score;
  score.median = shown(from.median);
  if (from.yield.n > 0) score.yield = share_of(from.in_spec, from.yield);
  score.steps = shown_arrival(from.steps_to_spec.estimate);
  return score;
}

std::vector<Lead> leads_of(const Group& group, statistics::Rule rule, const std::vector<Pair>& pairs) {
  const auto median = [rule](const Row* row) { return row->rules ? (*row->rules)[rule].median.estimate : kMissing; };
  std::vector<Lead> leads;
  for (const ObservationClass of_class : kClasses) {
    if (of_class == ObservationClass::oracle) continue;
    std::vector<const Row*> ranked;
    for (const Row& row : group.rows)
      if (row.of_class == of_class && std::isfinite(median(&row))) ranked.push_back(&row);
    if (ranked.empty()) continue;
    std::stable_sort(ranked.begin(), ranked.end(), [&](const Row* a, const Row* b) { return median(a) < median(b); });
    Lead lead = {of_class, ranked[0]->method, "", {}};
    if (ranked.size() > 1) {
      lead.next = ranked[1]->method;
      lead.pair = find_pair(pairs, lead.best, lead.next);
    }
    if (lead.pair) {
      lead.pair->ratio = shown(lead.pair->ratio);
      lead.pair->interval = shown(lead.pair->interval);
    }
    leads.push_back(std::move(lead));
  }
  return leads;
}

// Rules with scores in the group.
std::vector<statistics::Rule> recorded_rules(const Group& group) {
  std::vector<statistics::Rule> rules;
  for (const statistics::Rule rule : statistics::kRules)
    if (std::any_of(group.rows.begin(), group.rows.end(),
                    [&](const Row& row) { return row.rules && (*row.rules)[rule].median.n > 0; }))
      rules.push_back(rule);
  return rules;
}

std::string lead_verdict(const Lead& lead) {
  if (!lead.pair) return "";
  switch (lead.pair->verdict) {
    case statistics::Verdict::better:
      return " (better than " + lead.next + ")";
    case statistics::Verdict::worse:
      return " (lower median, but worse than " + lead.next + ")";
    case statistics::Verdict::practically_equal:
      return " (practically equal to " + lead.next + ")";
    case statistics::Verdict::undecided:
      break;
  }
  return " (undecided against " + lead.next + ")";
}

// A method that leads its class, with its verdict in words.
struct Leader {
  std::string method, verdict;
};

std::optional<Leader> leader_by_error(const Group& group, ObservationClass of_class, statistics::Rule rule) {
  for (const Lead& lead : (*group.rules)[rule].leads)
    if (lead.of_class == of_class) return Leader{lead.best, lead_verdict(lead)};
  return std::nullopt;
}

// Of equal yields, all methods.
std::optional<Leader> leader_by_yield(const Group& group, ObservationClass of_class, statistics::Rule rule) {
  std::optional<Leader> leader;
  std::size_t most = 0;
  for (const Row& row : group.rows) {
    if (row.of_class != of_class || !row.rules || !(*row.rules)[rule].yield) continue;
    const Share& yield = *(*row.rules)[rule].yield;
    if (leader && yield.in < most) continue;
    const bool equal = leader && yield.in == most;
    leader = {equal ? leader->method + " and " + row.method : row.method,
              " (" + std::to_string(yield.in) + " of " + std::to_string(yield.n) + ")"};
    most = yield.in;
  }
  return leader;
}

// "images: bo-gp by own (better than random), imitation by best and current (undecided against bo-gp)"; empty if all
// rules agree.
std::string differing_leads(const Group& group, const std::vector<statistics::Rule>& rules, bool by_yield) {
  struct Found {
    std::string method, verdict, rules;
  };
  std::string words;
  for (const ObservationClass of_class : kClasses) {
    std::vector<Found> found;
    for (const statistics::Rule rule : rules) {
      const auto leader = (by_yield ? leader_by_yield : leader_by_error)(group, of_class, rule);
      if (!leader) continue;
      const auto same = std::find_if(found.begin(), found.end(), [&](const Found& one) {
        return one.method == leader->method && one.verdict == leader->verdict;
      });
      if (same == found.end())
        found.push_back({leader->method, leader->verdict, statistics::rule_name(rule)});
      else
        same->rules += std::string(" and ") + statistics::rule_name(rule);
    }
    // The number in specification is not a verdict.
    if (std::all_of(found.begin(), found.end(), [&](const Found& one) {
          return one.method == found[0].method && (by_yield || one.verdict == found[0].verdict);
        }))
      continue;
    words += words.empty() ? "" : "; ";
    if (of_class != ObservationClass::unknown) words += group.words.observed(class_name(of_class)) + ": ";
    for (std::size_t i = 0; i < found.size(); ++i)
      words += (i ? ", " : "") + found[i].method + " by " + found[i].rules + found[i].verdict;
  }
  return words;
}

}  // namespace

std::string rules_note(const std::vector<Group>& groups, bool by_yield) {
  constexpr std::size_t kMaxGroups = 6;
  std::vector<std::string> differing;
  bool all_recorded = true, any = false;
  for (const Group& group : groups) {
    if (!group.rules) continue;
    any = true;
    const std::vector<statistics::Rule> rules = recorded_rules(group);
    all_recorded = all_recorded && rules.size() == statistics::kRules.size();
    if (const std::string words = differing_leads(group, rules, by_yield); !words.empty())
      differing.push_back(group.label + ": " + words);
  }
  if (!any) return "";
  std::string note;
  if (differing.empty()) {
    note = !all_recorded ? "Whether a verdict depends on the recommendation rule is unknown."
           : by_yield    ? "No verdict depends on the recommendation rule: by own, best and current the same method of "
                           "each class has the highest yield."
                         : "No verdict depends on the recommendation rule: by own, best and current the same method of "
                           "each class has the lowest median, with the same verdict against the second.";
  } else {
    note = "The verdict depends on the recommendation rule. ";
    for (std::size_t i = 0; i < std::min(differing.size(), kMaxGroups); ++i) note += (i ? ". " : "") + differing[i];
    note +=
        differing.size() > kMaxGroups ? "; and in " + std::to_string(differing.size() - kMaxGroups) + " more." : ".";
  }
  return note;
}

void add_rules(Group& group, const statistics::GroupStudy& found, const statistics::Study& study,
               double smallest_relevant_ratio) {
  for (Row& row : group.rows)
    if (const statistics::SeriesStudy* series = find_series(study, found, row.method)) {
      row.rules.emplace();
      for (const statistics::Rule rule : statistics::kRules) (*row.rules)[rule] = rule_score(series->rules[rule]);
    }
  group.rules.emplace();
  for (const statistics::Rule rule : statistics::kRules) {
    RuleComparison& comparison = (*group.rules)[rule];
    for (const statistics::PairStudy& pair : found.pairs_by_rule[rule])
      comparison.pairs.push_back(pair_of(pair, study, smallest_relevant_ratio));
    comparison.leads = leads_of(group, rule, comparison.pairs);
  }
}

Analysis analysis_of(const records::Manifest& manifest, statistics::Rule rule) {
  Analysis analysis;
  const std::string& began = manifest.analysis_began_with;
  if (!began.empty())
    analysis.notes.push_back(
        began == "none" ? "The analysis plan was written after the first trials had ended and is not a prior plan."
        : !manifest.analysis
            ? "The run began with the analysis plan " + began.substr(0, 16) + ", which was removed later."
            : "The analysis plan was changed after the first trials had ended; the run began with the plan " +
                  began.substr(0, 16) + ".");
  if (!manifest.analysis) return analysis;
  const AnalysisPlan& plan = *manifest.analysis;
  const std::string used = statistics::rule_name(rule);
  analysis.plan = json_of(plan);
  analysis.plan["hash"] = manifest.analysis_hash;
  if (plan.rule != used)
    analysis.notes.push_back("This page uses the rule '" + used + "', the analysis plan the rule '" + plan.rule + "'.");
  analysis.primary_is_yield = plan.primary == "yield";
  analysis.yield = plan.yield;
  analysis.summary = "Analysis plan (" + manifest.analysis_hash.substr(0, 16) + "): primary measure " + plan.primary +
                     ", rule " + plan.rule + ", smallest relevant ratio " +
                     significant(plan.smallest_relevant_ratio, 3) +
                     (std::isnan(plan.yield) ? "" : ", target yield " + significant(plan.yield, 3)) + ".";
  return analysis;
}

const char* rule_text(statistics::Rule rule) {
  return rule == statistics::Rule::best      ? "the pose with the lowest measured error"
         : rule == statistics::Rule::current ? "the current pose"
                                             : "the pose recommended by the method";
}

}  // namespace relign::report
