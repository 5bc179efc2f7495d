#include "records/step_numbers.h"

#include <simdjson.h>

#include <cmath>
#include <limits>

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

bool take(fast::object& object, const char* key, double& number) {
  fast::value value;
  return !object.find_field(key).get(value) && take(value, number);
}

// Members in the order in which step_line writes them.
bool take_all(fast::object object, StepNumbers& step) {
  std::uint64_t number = 0;
  if (object.find_field("step").get_uint64().get(number)) return false;
  if (number > kMaxSteps) return false;
  step.step = static_cast<unsigned>(number);
  if (!take(object, "merit", step.merit) || !take(object, "measured", step.measured) ||
      !take(object, "machine_seconds", step.machine_seconds))
    return false;
  std::string_view text;
  if (object.find_field("recommendation").get_string().get(text)) return false;
  step.recommendation = text;
  if (!take(object, "recommended_seconds", step.recommended_seconds)) return false;
  fast::array pose;
  if (object.find_field("recommended_true_pose").get_array().get(pose)) return false;
  for (auto element : pose) {
    fast::value value;
    step.recommended_true_pose.emplace_back();
    if (element.get(value) || !take(value, step.recommended_true_pose.back())) return false;
  }
  return take(object, "commanded_mse", step.commanded_mse) && take(object, "recommended_mse", step.recommended_mse);
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
      !document.get_object().get(object) && take_all(object, step))
    return step;
  // Another order of members, or a damaged line: the reader of whole records accepts it or reports what is wrong.
  const ReadLine read = read_trial_line(line, std::string(place));
  const StepRecord& record = read.step;
  return {record.step,          record.measured,        record.machine_seconds, record.recommended_seconds,
          record.commanded_mse, record.recommended_mse, record.recommendation,  record.recommended_true_pose,
          record.merit};
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
