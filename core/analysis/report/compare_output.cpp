// A comparison as JSON and as text.
#include "base/text.h"
#include "markup/escape.h"
#include "report/compare.h"
#include "report/json_put.h"

namespace relign::report {
namespace {

Json yield_json(const statistics::PairedShares& yield) {
  Json json;
  if (yield.n > 0)
    put(json, "n", yield.n, "a", yield.first, "b", yield.second, "a_alone", yield.first_alone, "b_alone",
        yield.second_alone, "p", shown(yield.p));
  return json;
}

void put_methods(Json& json, const ComparedMethods& of) {
  put(json, "scene", of.scene, "noise_level", of.noise_level, "protocol", of.protocol, "a", of.a, "b", of.b);
}

void put_errors(Json& json, const ComparedErrors& errors) {
  put(json, "median_a", shown(errors.median_a), "median_b", shown(errors.median_b), "ratio", errors.ratio, "p",
      errors.p, "verdict", statistics::verdict_name(errors.verdict), "yield", yield_json(errors.yield));
  put_interval(json, errors.interval);
}

Json compared_json(const ComparedPair& pair) {
  Json json;
  put_methods(json, pair);
  put_errors(json, pair.errors);
  put(json, "step", pair.step, "n", pair.errors.n, "missing", pair.missing, "failed_a", pair.failed_a, "failed_b",
      pair.failed_b, "improvement", pair.errors.improvement, "differs", pair.differs);
  put_filled(json, "reason", pair.errors.reason);
  if (!pair.rules) return json;
  for (const statistics::Rule rule : statistics::kRules) {
    Json& of_rule = json["rules"][statistics::rule_name(rule)];
    if ((*pair.rules)[rule]) put_errors(of_rule, *(*pair.rules)[rule]);
  }
  return json;
}

std::string heading(const ComparedMethods& of) {
  return terminal_text(of.scene + ", " + of.noise_level + ", " + of.protocol + ": " +
                       (of.a == of.b ? of.a : of.a + " (A) and " + of.b + " (B)"));
}

// "  by rule: own better (0.510), best undecided (0.970), current not recorded"
std::string rules_line(const ComparedPair& pair) {
  if (!pair.rules) return "";
  std::string words;
  for (const statistics::Rule rule : statistics::kRules) {
    const std::optional<ComparedErrors>& found = (*pair.rules)[rule];
    words +=
        (words.empty() ? "  by rule: " : ", ") + std::string(statistics::rule_name(rule)) + " " +
        (found ? statistics::verdict_name(found->verdict) + (" (" + number_text(found->ratio) + ")") : "not recorded");
  }
  return words + "\n";
}

std::string yield_line(const statistics::PairedShares& yield) {
  if (yield.n == 0) return "";
  return "  in specification: A " + std::to_string(yield.first) + ", B " + std::to_string(yield.second) + " of " +
         std::to_string(yield.n) + " instances; only A " + std::to_string(yield.first_alone) + ", only B " +
         std::to_string(yield.second_alone) + ", p " + significant(shown(yield.p), 2) + "\n";
}

std::string pair_lines(const Comparison& comparison, const ComparedPair& pair) {
  const ComparedErrors& errors = pair.errors;
  const std::string track = statistics::track_name(comparison.track), rule = statistics::rule_name(comparison.rule);
  std::string out = heading(pair) + "\n  " + track +
                    (track == "recommended" && rule != "own" ? " (rule " + rule + ")" : "") + " after step " +
                    std::to_string(pair.step) + ": median A " + number_text(shown(errors.median_a)) + ", B " +
                    number_text(shown(errors.median_b)) + "; ratio B / A over " + std::to_string(errors.n) +
                    " common instances " + number_text(errors.ratio) + " (95 % CI " + number_text(errors.interval.low) +
                    " to " + number_text(errors.interval.high) + ")\n  B is " +
                    statistics::verdict_name(errors.verdict) + "; lower error on " +
                    number_text(100 * errors.improvement, 2) + " % of the instances, p " + number_text(errors.p, 2);
  if (pair.failed_a + pair.failed_b > 0)
    out += "; failed trials: A " + std::to_string(pair.failed_a) + ", B " + std::to_string(pair.failed_b);
  out += "\n";
  if (!errors.reason.empty()) out += "  reason: " + errors.reason + "\n";
  out += rules_line(pair);
  if (!pair.differs.empty())
    out += "  A and B are different methods of the same name: they differ in " + join(pair.differs, ", ") + "\n";
  return out + yield_line(errors.yield);
}

}  // namespace

Json to_json(const Comparison& comparison) {
  Json json, pairs = Json::array(), gates = Json::array();
  for (const ComparedPair& pair : comparison.pairs) pairs.push_back(compared_json(pair));
  for (const GateResult& gate : comparison.gates) {
    Json& made = gates.emplace_back(Json());
    put_methods(made, gate);
    put(made, "gate", gate.gate, "value", shown(gate.value), "holds", gate.holds);
  }
  put(json, "rule", statistics::rule_name(comparison.rule), "track", statistics::track_name(comparison.track),
      "smallest_relevant_ratio", comparison.smallest_relevant_ratio, "pairs", pairs, "gates", gates, "unmatched",
      comparison.unmatched, "holds", comparison.holds);
  return json;
}

std::string comparison_text(const Comparison& comparison) {
  std::string out;
  for (const ComparedPair& pair : comparison.pairs) out += pair_lines(comparison, pair);
  for (const std::string& name : comparison.unmatched) out += "only in A: " + terminal_text(name) + "\n";
  for (const GateResult& gate : comparison.gates)
    out += (gate.holds ? "passed  " : "FAILED  ") + gate.gate + "  " + number_text(shown(gate.value), 4) + "  " +
           heading(gate) + "\n";
  return out;
}

}  // namespace relign::report
