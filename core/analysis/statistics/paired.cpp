#include "statistics/paired.h"

#include <cmath>
#include <string>

#include "base/error.h"
#include "statistics/bootstrap.h"
#include "statistics/proportion.h"

namespace relign::statistics {
namespace {

double logarithm(double value, std::size_t instance) {
  if (value < 0) {
    throw Error(ErrorKind::bad_input, "instance " + std::to_string(instance) + " has the negative value " +
                                          std::to_string(value) +
                                          ", which has no logarithm; compare raw values, or clip at 0");
  }
  return std::log(value);
}

}  // namespace

std::vector<double> paired_differences(const std::vector<double>& first, const std::vector<double>& second,
                                       Scale scale) {
  if (first.size() != second.size()) {
    throw Error(ErrorKind::internal, std::to_string(first.size()) + " and " + std::to_string(second.size()) +
                                         " values cannot be paired; give one value per instance, NaN if missing");
  }
  std::vector<double> differences(first.size(), kMissing);
  for (std::size_t instance = 0; instance < first.size(); ++instance) {
    double a = first[instance], b = second[instance];
    if (std::isnan(a) || std::isnan(b)) continue;
    if (scale == Scale::logarithmic) {
      a = logarithm(a, instance);
      b = logarithm(b, instance);
    }
    differences[instance] = a == b ? 0 : a - b;  // infinity - infinity would be NaN
  }
  return differences;
}

const char* verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::better:
      return "better";
    case Verdict::worse:
      return "worse";
    case Verdict::practically_equal:
      return "practically equal";
    case Verdict::undecided:
      break;
  }
  return "undecided";
}

Verdict verdict_of(const Interval& difference, double smallest_relevant) {
  if (!(smallest_relevant >= 0)) {
    throw Error(ErrorKind::bad_input, "the smallest relevant difference must be 0 or a positive number, not " +
                                          std::to_string(smallest_relevant));
  }
  if (!difference.exists()) return Verdict::undecided;
  if (difference.high < -smallest_relevant) return Verdict::better;
  if (difference.low > smallest_relevant) return Verdict::worse;
  const bool within = difference.low >= -smallest_relevant && difference.high <= smallest_relevant;
  return within ? Verdict::practically_equal : Verdict::undecided;
}

PairedComparison compare_paired(const std::vector<double>& first, const std::vector<double>& second,
                                const Resampling& resampling, const PairedOptions& options) {
  const std::vector<double> differences = paired_differences(first, second, options.scale);
  PairedComparison result;
  double score = 0;
  for (const double difference : differences) {
    if (std::isnan(difference)) {
      ++result.missing;
    } else {
      score += difference < 0 ? 1 : difference == 0 ? 0.5 : 0;
    }
  }
  result.difference = bands(resampling, {differences}, options.statistic, options.confidence).front();
  result.test = signed_rank(differences);
  result.probability_of_improvement = share_of_scores(score, differences.size() - result.missing, options.confidence);
  result.verdict = verdict_of(result.difference.interval, options.smallest_relevant);
  return result;
}

}  // namespace relign::statistics
