#include "report/verdict_cases.h"

#include <array>
#include <cmath>

#include "base/json_members.h"
#include "base/text.h"
#include "report/page_data.h"
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

VerdictCase case_of(const Json& pair, double smallest_relevant_ratio) {
  const std::string word = text_of(pair, "verdict");
  if (word == "better") return VerdictCase::better;
  if (word == "worse") return VerdictCase::worse;
  if (word == "practically equal") return VerdictCase::practically_equal;
  const double low = number_in(pair, "lo95"), high = number_in(pair, "hi95");
  if (count_of(pair, "n") < statistics::kMinCompared) return VerdictCase::too_few_instances;
  if (std::isnan(low) || std::isnan(high)) return VerdictCase::no_interval;
  const bool may_be_better = low<1 / smallest_relevant_ratio, may_be_worse = high> smallest_relevant_ratio;
  return may_be_better && may_be_worse ? VerdictCase::may_be_either
         : may_be_worse                ? VerdictCase::may_be_worse
                                       : VerdictCase::may_be_better;
}

std::string undecided_reason(const Json& pair, double smallest_relevant_ratio) {
  const std::uint64_t n = count_of(pair, "n");
  std::string text = sentences_of(case_of(pair, smallest_relevant_ratio)).reason;
  text = filled_in(text, "n", std::to_string(n));
  text = filled_in(text, "needed", std::to_string(statistics::kMinCompared));
  text = filled_in(text, "low", significant(1 / smallest_relevant_ratio, 3));
  return filled_in(text, "high", significant(smallest_relevant_ratio, 3));
}

std::string verdict_sentence(const Json& pair, double smallest_relevant_ratio) {
  const std::string first = text_of(pair, "a");
  const auto shown = [&](const char* key) { return significant(number_in(pair, key), 2); };
  const bool interval = member(pair, "lo95").is_number() && member(pair, "hi95").is_number();
  std::string figures =
      "paired by instance, the error of " + first + " is " + shown("ratio") + " times that of " + text_of(pair, "b");
  if (interval) figures += " (95 % CI " + shown("lo95") + " to " + shown("hi95") + ")";
  std::string text = sentences_of(case_of(pair, smallest_relevant_ratio)).verdict;
  text = filled_in(text, "reason", undecided_reason(pair, smallest_relevant_ratio));
  text = filled_in(text, "high", significant(smallest_relevant_ratio, 3));
  text = filled_in(text, "figures", figures);
  return filled_in(text, "first", first);
}

Json turned(const Json& pair) {
  const auto inverse = [&](const char* key) {
    const double value = number_in(pair, key);
    return std::isnan(value) ? Json() : Json(1 / value);
  };
  Json other = pair;
  other["a"] = member(pair, "b");
  other["b"] = member(pair, "a");
  other["ratio"] = inverse("ratio");
  other["lo95"] = inverse("hi95");
  other["hi95"] = inverse("lo95");
  const std::string word = text_of(pair, "verdict");
  other["verdict"] = word == "better" ? "worse" : word == "worse" ? "better" : word;
  return other;
}

}  // namespace relign::report
