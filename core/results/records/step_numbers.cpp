#include "records/step_numbers.h"

#include <simdjson.h>

#include <cmath>
#include <limits>
#include <utility>

#include "base/limits.h"
#include "records/record.h"

namespace relign::records {
namespace {

namespace fast = simdjson::ondemand;

// simdjson before 3.6.3 reads 0.19999999999999999999 as 0.0155 (its issue 2093), so that numbers of more than 19 digits
// go to the other reader. We write 17 at most.
constexpr int kMaxDigits = 19;

bool has_more_digits(std::string_view number) {
  int digits = 0;
  for (const char c : number) {
    if (c == 'e' || c == 'E') break;
    if (c >= '0' && c <= '9' && (digits > 0 || c != '0')) ++digits;
  }
  return digits > kMaxDigits;
}

// Null stands for a non-finite number. Returns false for anything but null and a number that can be read here.
bool take(fast::value value, double& number) {
  fast::json_type type;
  if (value.type().get(type)) return false;
  number = std::numeric_limits<double>::quiet_NaN();
  if (type == fast::json_type::null) return true;
  return type == fast::json_type::number && !has_more_digits(value.raw_json_token()) && !value.get_double().get(number);
}

bool take(fast::value value, std::string& text) {
  std::string_view found;
  if (value.get_string().get(found)) return false;
  text = found;
  return true;
}

bool take(fast::value value, std::vector<double>& numbers) {
  fast::array list;
  if (value.get_array().get(list)) return false;
  for (auto element : list) {
    fast::value number;
    numbers.emplace_back();
    if (element.get(number) || !take(number, numbers.back())) return false;
  }
  return true;
}

bool take(fast::value value, unsigned& step) {
  std::uint64_t number = 0;
  if (value.get_uint64().get(number) || number > kMaxSteps) return false;
  step = static_cast<unsigned>(number);
  return true;
}

// The members that step_line writes, in its order.
enum Member {
  kTrial,
  kStep,
  kCommandedPose,
  kTruePose,
  kLimitsLow,
  kLimitsHigh,
  kMerit,
  kMeasured,
  kRegions,
  kMachineSeconds,
  kRecommendedPose,
  kRecommendation,
  kRecommendedSeconds,
  kRecommendedTruePose,
  kCommandedMse,
  kCommandedMseError,
  kRecommendedMse,
  kRecommendedMseError,
  kMembers
};
constexpr std::string_view kNames[kMembers] = {"trial",
                                               "step",
                                               "commanded_pose",
                                               "true_pose",
                                               "limits_low",
                                               "limits_high",
                                               "merit",
                                               "measured",
                                               "regions",
                                               "machine_seconds",
                                               "recommended_pose",
                                               "recommendation",
                                               "recommended_seconds",
                                               "recommended_true_pose",
                                               "commanded_mse",
                                               "commanded_mse_error",
                                               "recommended_mse",
                                               "recommended_mse_error"};

bool take(fast::value value, Member member, StepNumbers& step) {
  switch (member) {
    case kStep:
      return take(value, step.step);
    case kMerit:
      return take(value, step.merit);
    case kMeasured:
      return take(value, step.measured);
    case kRegions:
      return step.of_regions = true;
    case kMachineSeconds:
      return take(value, step.machine_seconds);
    case kRecommendation:
      return take(value, step.recommendation);
    case kRecommendedSeconds:
      return take(value, step.recommended_seconds);
    case kRecommendedTruePose:
      return take(value, step.recommended_true_pose);
    case kCommandedMse:
      return take(value, step.commanded_mse);
    case kRecommendedMse:
      return take(value, step.recommended_mse);
    default:
      return true;
  }
}

// False unless the line has every member once and in order, so that no key is there twice: this reader would take the
// first, and another one the last.
bool take_all(fast::object object, StepNumbers& step) {
  int next = kTrial;
  for (auto found : object) {
    fast::field field;
    if (std::move(found).get(field)) return false;
    if (next == kRegions && field.key() != kNames[kRegions]) ++next;
    if (next == kMembers || field.key() != kNames[next]) return false;
    if (!take(field.value(), static_cast<Member>(next++), step)) return false;
  }
  return next == kMembers;
}

bool is_read(fast::document& document) {
  const char* rest = nullptr;
  return document.current_location().get(rest) == simdjson::OUT_OF_BOUNDS;
}

}  // namespace

struct StepNumbersReader::Parser {
  fast::parser parser;
  std::string line;  // with reserved padding, which the parser may read
};

StepNumbersReader::StepNumbersReader() : parser_(std::make_unique<Parser>()) {}
StepNumbersReader::~StepNumbersReader() = default;
StepNumbersReader::StepNumbersReader(StepNumbersReader&&) noexcept = default;
StepNumbersReader& StepNumbersReader::operator=(StepNumbersReader&&) noexcept = default;

StepNumbers StepNumbersReader::read(std::string_view line, std::string_view place) {
  StepNumbers step;
  parser_->line.reserve(line.size() + simdjson::SIMDJSON_PADDING);
  parser_->line.assign(line);
  fast::document document;
  fast::object object;
  if (!parser_->parser.iterate(parser_->line.data(), line.size(), parser_->line.capacity()).get(document) &&
      !document.get_object().get(object) && take_all(object, step) && is_read(document))
    return step;
  step = StepNumbers();
  // Another order of members, or a damaged line: the reader of whole records accepts it or reports what is wrong.
  const StepRecord record = read_trial_line(line, std::string(place)).step;
  step.step = record.step;
  step.measured = record.measured;
  step.machine_seconds = record.machine_seconds;
  step.recommended_seconds = record.recommended_seconds;
  step.commanded_mse = record.commanded_mse;
  step.recommended_mse = record.recommended_mse;
  step.recommendation = record.recommendation;
  step.recommended_true_pose = record.recommended_true_pose;
  step.merit = record.merit;
  step.of_regions = !record.regions.empty();
  return step;
}

void set_glued(const TrialRecord& closing, std::vector<StepNumbers>& steps) {
  const bool shifts = std::isfinite(closing.uncured_mse);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (!shifts)
      steps[i].glued_mse = steps[i].commanded_mse;
    else if (closing.glued_mse.size() == steps.size())
      steps[i].glued_mse = closing.glued_mse[i];
    if (closing.best_mse.size() == steps.size()) steps[i].best_mse = closing.best_mse[i];
  }
}

}  // namespace relign::records
