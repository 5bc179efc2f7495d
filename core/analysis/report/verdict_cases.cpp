#include "report/verdict_cases.h"

#include <array>
#include <cmath>

#include "base/text.h"
#include "statistics/study.h"

namespace relign::report {
namespace {

struct Sentences {
  VerdictCase of;
  const char* verdict;
  const char* reason;  // empty if decided
};
// {low} and {high} are the ratios beyond which a difference is relevant. Reasons are shown beside the verdict on the
// first method as well, so they name no method.
constexpr std::array<Sentences, 8> kSentences = {{
    {VerdictCase::better, "{first} is better: {figures}", ""},
    {VerdictCase::worse, "{first} is worse: {figures}", ""},
    {VerdictCase::practically_equal,
     "The two are practically equal: {figures}, within the smallest relevant ratio of {high}", ""},
    {VerdictCase::too_few_instances, "The comparison is undecided: {figures}; {reason}",
     "at least {needed} common instances are needed, found {n}"},
    {VerdictCase::no_interval, "The comparison is undecided: {reason}", "there is no 95 % interval"},
    {VerdictCase::may_be_better, "The comparison is undecided: {figures}; {reason}",
     "the interval crosses {low}, so better and practically equal are both possible; more instances would narrow it"},
    {VerdictCase::may_be_worse, "The comparison is undecided: {figures}; {reason}",
     "the interval crosses {high}, so worse and practically equal are both possible; more instances would narrow it"},
    {VerdictCase::may_be_either, "The comparison is undecided: {figures}; {reason}",
     "the interval crosses both {low} and {high}, so either may be better; more instances would narrow it"},
}};

const Sentences& sentences_of(VerdictCase of) {
  for (const Sentences& sentences : kSentences)
    if (sentences.of == of) return sentences;
  return kSentences.back();
}

std::string filled_in(std::string text, const std::string& name, const std::string& value) {
  const std::string place = "{" + name + "}";
  if (const std::size_t at = text.find(place); at != std::string::npos) text.replace(at, place.size(), value);
  return text;
}

}  // namespace

VerdictCase case_of(const Difference& difference, double smallest_relevant_ratio) {
  using statistics::Verdict;
  if (difference.verdict == Verdict::better) return VerdictCase::better;
  if (difference.verdict == Verdict::worse) return VerdictCase::worse;
  if (difference.verdict == Verdict::practically_equal) return VerdictCase::practically_equal;
  if (difference.n < statistics::kMinCompared) return VerdictCase::too_few_instances;
  if (!difference.interval.exists()) return VerdictCase::no_interval;
  const bool may_be_better = difference.interval.low < 1 / smallest_relevant_ratio;
  const bool may_be_worse = difference.interval.high > smallest_relevant_ratio;
  return may_be_better && may_be_worse ? VerdictCase::may_be_either
         : may_be_worse                ? VerdictCase::may_be_worse
                                       : VerdictCase::may_be_better;
}

std::string undecided_reason(const Difference& difference, double smallest_relevant_ratio) {
  std::string text = sentences_of(case_of(difference, smallest_relevant_ratio)).reason;
  text = filled_in(text, "n", std::to_string(difference.n));
  text = filled_in(text, "needed", std::to_string(statistics::kMinCompared));
  text = filled_in(text, "low", significant(1 / smallest_relevant_ratio, 3));
  return filled_in(text, "high", significant(smallest_relevant_ratio, 3));
}

std::string verdict_sentence(const Pair& pair, double smallest_relevant_ratio) {
  std::string figures =
      "paired by instance, the error of " + pair.a + " is " + significant(pair.ratio, 2) + " times that of " + pair.b;
  if (pair.interval.exists()) figures += " (95 % CI " + interval_text(pair.interval, 2, " to ") + ")";
  std::string text = sentences_of(case_of(pair, smallest_relevant_ratio)).verdict;
  text = filled_in(text, "reason", undecided_reason(pair, smallest_relevant_ratio));
  text = filled_in(text, "high", significant(smallest_relevant_ratio, 3));
  text = filled_in(text, "figures", figures);
  return filled_in(text, "first", pair.a);
}

Pair turned(Pair pair) {
  using statistics::Verdict;
  std::swap(pair.a, pair.b);
  pair.ratio = 1 / pair.ratio;
  pair.interval = {1 / pair.interval.high, 1 / pair.interval.low};
  if (pair.verdict == Verdict::better || pair.verdict == Verdict::worse)
    pair.verdict = pair.verdict == Verdict::better ? Verdict::worse : Verdict::better;
  return pair;
}

std::optional<Pair> find_pair(const std::vector<Pair>& pairs, const std::string& first, const std::string& second) {
  for (const Pair& pair : pairs) {
    if (pair.a == first && pair.b == second) return pair;
    if (pair.a == second && pair.b == first) return turned(pair);
  }
  return std::nullopt;
}

}  // namespace relign::report
