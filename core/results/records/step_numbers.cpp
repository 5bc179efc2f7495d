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

bool take(fast::value value, std::uint64_t& number) { return !value.get_uint64().get(number); }

bool take(fast::value value, unsigned& step) {
  std::uint64_t number = 0;
  if (!take(value, number) || number > kMaxSteps) return false;
  step = static_cast<unsigned>(number);
  return true;
}

bool take(fast::value value, PixelRegions& regions) {
  fast::array list;
  std::string_view json;
  if (value.get_array().get(list) || list.raw_json().get(json)) return false;
  try {
    regions = read_regions(valid_json(json));
    return true;
  } catch (const Error&) {
    return false;
  }
}

// Takes the columns of a line. Fails unless the line has every member once and in order, so that no key is there twice:
// this reader would take the first, and another one the last.
class Taker {
 public:
  explicit Taker(fast::object& object) : intact_(!object.begin().get(at_) && !object.end().get(end_)) { look(); }

  template <class Value>
  void operator()(const Column& column, Value& value) {
    if (!intact_) return;
    if (!more_ || field_.key() != column.key) return void(intact_ = column.is(kOptional));
    intact_ = take(field_.value(), value);
    next();
  }
  void skip(std::string_view key) {
    if (intact_ && more_ && (intact_ = field_.key() == key)) next();
  }
  bool took_all() const { return intact_ && !more_; }

 private:
  void next() {
    ++at_;
    look();
  }
  void look() {
    more_ = intact_ && at_ != end_;
    if (more_) intact_ = !(*at_).get(field_);
  }
  fast::object_iterator at_, end_;
  fast::field field_;
  bool intact_, more_ = false;
};

bool take_all(fast::object object, StepNumbers& step) {
  Taker taker(object);
  taker.skip("trial");
  step_columns(taker, static_cast<StepRecord&>(step));
  return taker.took_all();
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
  // Another order of members, or a damaged line: the reader of whole records accepts it or reports what is wrong.
  return {read_trial_line(line, std::string(place)).step};
}

void set_scores(const TrialRecord& closing, std::vector<StepNumbers>& steps) {
  const Scores& scores = closing.scores;
  const bool shifts = std::isfinite(scores.uncured_mse[Rule::own]);
  const std::vector<double>&glued = scores.by_step[Rule::current].mse, &best = scores.by_step[Rule::best].mse;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (!shifts)
      steps[i].glued_mse = steps[i].commanded_mse;
    else if (glued.size() == steps.size())
      steps[i].glued_mse = glued[i];
    if (best.size() == steps.size()) steps[i].best_mse = best[i];
  }
}

}  // namespace relign::records
