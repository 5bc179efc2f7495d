#include "records/record.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>

#include "base/fault.h"
#include "base/limits.h"
#include "base/text.h"

namespace relign::records {
namespace {

// Writes one JSON object with its keys in the order they are added (nlohmann::json sorts them), so that a line starts
// with the trial's id.
class LineWriter {
 public:
  LineWriter& add(const char* key, double value) { return raw(key, number(value)); }
  LineWriter& add(const char* key, std::uint64_t value) { return raw(key, std::to_string(value)); }
  LineWriter& add(const char* key, unsigned value) { return raw(key, std::to_string(value)); }
  LineWriter& add(const char* key, int value) { return raw(key, std::to_string(value)); }
  LineWriter& add(const char* key, const std::string& value) { return raw(key, text(value)); }
  LineWriter& add(const char* key, const std::vector<double>& values) {
    std::string list;
    for (const double value : values) {
      if (!list.empty()) list += ',';
      list += number(value);
    }
    return raw(key, "[" + list + "]");
  }
  LineWriter& add(const char* key, const std::vector<std::string>& values) {
    std::string list;
    for (const std::string& value : values) {
      if (!list.empty()) list += ',';
      list += text(value);
    }
    return raw(key, "[" + list + "]");
  }
  LineWriter& raw(const char* key, const std::string& json) {
    line_ += line_.empty() ? "{\"" : ",\"";
    line_ += key;
    line_ += "\":";
    line_ += json;
    return *this;
  }
  std::string close() const { return line_ + "}"; }

  static std::string number(double value) {
    if (!std::isfinite(value)) return "null";
    if (value == 0 && std::signbit(value)) return "-0.0";  // readers take "-0" for the integer 0
    return shortest(value);
  }
  // A plugin's message may hold any bytes: invalid UTF-8 is replaced, line breaks are escaped.
  static std::string text(const std::string& value) {
    return Json(value).dump(-1, ' ', false, Json::error_handler_t::replace);
  }

 private:
  std::string line_;
};

double read_number(const Json& value) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

std::vector<double> read_numbers(const Json& list) {
  std::vector<double> values;
  values.reserve(list.size());
  for (const Json& value : list.get_ref<const Json::array_t&>()) values.push_back(read_number(value));
  return values;
}

// Checked: get<unsigned>() would turn 4294967296 into 0, and 1e300 into anything.
template <class Whole>
Whole read_whole(const Json& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::numeric_limits<Whole>::max())
    throw Error(ErrorKind::bad_input, "expected an integer from 0 to " +
                                          std::to_string(std::numeric_limits<Whole>::max()) + ", found " +
                                          value.dump().substr(0, 40));
  return static_cast<Whole>(value.get<std::uint64_t>());
}

// Restricted because files are named after it.
std::string read_id(const Json& value) {
  constexpr std::size_t kLongest = 64;
  const std::string id = value.get<std::string>();
  const bool plain = !id.empty() && id.size() <= kLongest && id.front() != '.' &&
                     std::all_of(id.begin(), id.end(), [](unsigned char letter) {
                       return std::isalnum(letter) || letter == '-' || letter == '_' || letter == '.';
                     });
  if (!plain) throw Error(ErrorKind::bad_input, "invalid trial id '" + id.substr(0, kLongest) + "'");
  return id;
}

std::uint64_t read_seed(const std::string& digits) {
  std::uint64_t seed = 0;
  const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), seed);
  if (code != std::errc() || end != digits.data() + digits.size())
    throw Error(ErrorKind::bad_input, "invalid seed '" + digits.substr(0, 40) + "'");
  return seed;
}

unsigned read_steps(const Json& value) {
  const auto steps = read_whole<unsigned>(value);
  if (steps > kMaxSteps)
    throw Error(ErrorKind::bad_input,
                "found step " + std::to_string(steps) + "; a trial has at most " + std::to_string(kMaxSteps));
  return steps;
}

StepRecord read_step(const Json& line) {
  StepRecord step;
  step.step = read_steps(line.at("step"));
  step.commanded_pose = read_numbers(line.at("commanded_pose"));
  step.true_pose = read_numbers(line.at("true_pose"));
  step.limits_low = read_whole<std::uint64_t>(line.at("limits_low"));
  step.limits_high = read_whole<std::uint64_t>(line.at("limits_high"));
  step.merit = read_number(line.at("merit"));
  step.measured = read_number(line.at("measured"));
  if (const auto regions = line.find("regions"); regions != line.end()) step.regions = read_regions(*regions);
  step.machine_seconds = read_number(line.at("machine_seconds"));
  step.recommended_pose = read_numbers(line.at("recommended_pose"));
  step.recommendation = line.at("recommendation").get<std::string>();
  step.recommended_seconds = read_number(line.at("recommended_seconds"));
  step.recommended_true_pose = read_numbers(line.at("recommended_true_pose"));
  step.commanded_mse = read_number(line.at("commanded_mse"));
  step.commanded_mse_error = read_number(line.at("commanded_mse_error"));
  step.recommended_mse = read_number(line.at("recommended_mse"));
  step.recommended_mse_error = read_number(line.at("recommended_mse_error"));
  return step;
}

// Values per step with their standard errors; leaves both empty where the line lacks them.
void read_per_step(const Json& line, const std::string& key, std::vector<double>& values, std::vector<double>& errors) {
  const auto found = line.find(key);
  if (found == line.end()) return;
  values = read_numbers(*found);
  errors = read_numbers(line.at(key + "_error"));
  if (values.size() != line.at("steps").get<std::size_t>())
    throw Error(ErrorKind::bad_input, "" + key + " has " + std::to_string(values.size()) + " values for " +
                                          line.at("steps").dump() + " steps");
}

MtfRecord read_mtf(const Json& line, const std::string& prefix) {
  MtfRecord mtf;
  if (const auto centre = line.find(prefix + "centre"); centre != line.end()) mtf.centre = read_number(*centre);
  if (const auto corner = line.find(prefix + "corner"); corner != line.end()) mtf.corner = read_number(*corner);
  return mtf;
}

void add_mtf(LineWriter& line, const std::string& prefix, const MtfRecord& mtf) {
  if (std::isfinite(mtf.centre)) line.add((prefix + "centre").c_str(), mtf.centre);
  if (std::isfinite(mtf.corner)) line.add((prefix + "corner").c_str(), mtf.corner);
}

TrialRecord read_closing(const Json& line) {
  TrialRecord record;
  record.trial = read_id(line.at("trial"));
  record.end = line.at("end").get<std::string>();
  record.budget = read_steps(line.at("budget"));
  record.scene = line.at("scene").get<std::string>();
  record.noise_level = line.at("noise_level").get<std::string>();
  record.protocol = line.at("protocol").get<std::string>();
  record.algorithm = line.at("algorithm").get<std::string>();
  record.algorithm_id = line.at("algorithm_id").get<std::string>();
  if (const auto method = line.find("method"); method != line.end()) record.method = method->get<std::string>();
  if (const auto training = line.find("training"); training != line.end())
    record.training = training->get<std::string>();
  record.instance = read_whole<std::uint64_t>(line.at("instance"));
  record.instance_seed = read_seed(line.at("instance_seed").get<std::string>());
  const Json& own_optimum = line.at("own_optimum_mse");
  record.has_own_optimum = !own_optimum.is_null();
  if (record.has_own_optimum) record.own_optimum_mse = own_optimum.get<double>();
  record.own_optimum_pose = read_numbers(line.at("own_optimum_pose"));
  if (const auto uncured = line.find("uncured_mse"); uncured != line.end()) record.uncured_mse = read_number(*uncured);
  record.mtf = read_mtf(line, "mtf_");
  record.uncured_mtf = read_mtf(line, "uncured_mtf_");
  record.own_optimum_mtf = read_mtf(line, "own_optimum_mtf_");
  read_per_step(line, "glued_mse", record.glued_mse, record.glued_mse_error);
  read_per_step(line, "best_mse", record.best_mse, record.best_mse_error);
  if (const auto mse = line.find("best_uncured_mse"); mse != line.end()) record.best_uncured_mse = read_number(*mse);
  record.best_mtf = read_mtf(line, "best_mtf_");
  record.best_uncured_mtf = read_mtf(line, "best_uncured_mtf_");
  record.current_mtf = read_mtf(line, "current_mtf_");
  record.current_uncured_mtf = read_mtf(line, "current_uncured_mtf_");
  for (const Criterion criterion : kCriteria)
    if (const auto values = line.find(criterion_name(criterion)); values != line.end()) {
      record.criteria[criterion] = read_numbers(*values);
      if (record.criteria[criterion].size() != line.at("steps").get<std::size_t>())
        throw Error(ErrorKind::bad_input, std::string("") + criterion_name(criterion) + " has " +
                                              std::to_string(record.criteria[criterion].size()) + " values for " +
                                              line.at("steps").dump() + " steps");
    }
  if (const auto pose = line.find("criterion_optimum_pose"); pose != line.end()) {
    record.criterion_optimum_pose = read_numbers(*pose);
    record.criterion_optimum_deficit = read_number(line.at("criterion_optimum_deficit"));
  }
  record.message = line.at("message").get<std::string>();
  record.warnings = line.at("warnings").get<std::vector<std::string>>();
  return record;
}

template <class Body>
auto reading(const std::string& place, Body&& body) -> decltype(body()) {
  std::string why;
  try {
    return body();
  } catch (const NewerFormat& error) {
    throw NewerFormat(place.empty() ? error.what() : place + ": " + error.what());
  } catch (const Error& error) {
    why = error.what();
  } catch (const Json::exception& error) {
    why = json_fault(error);
  }
  throw Error(ErrorKind::bad_input, place.empty() ? why : place + ": the line is damaged: " + why);
}

}  // namespace

bool ended_well(const std::string& end) { return end == "budget_spent" || end == "finished"; }

std::string step_line(const std::string& trial, const StepRecord& step) {
  LineWriter line;
  line.add("trial", trial)
      .add("step", step.step)
      .add("commanded_pose", step.commanded_pose)
      .add("true_pose", step.true_pose)
      .add("limits_low", step.limits_low)
      .add("limits_high", step.limits_high)
      .add("merit", step.merit)
      .add("measured", step.measured);
  if (!step.regions.empty()) line.raw("regions", to_json_text(step.regions));
  line.add("machine_seconds", step.machine_seconds)
      .add("recommended_pose", step.recommended_pose)
      .add("recommendation", step.recommendation)
      .add("recommended_seconds", step.recommended_seconds)
      .add("recommended_true_pose", step.recommended_true_pose)
      .add("commanded_mse", step.commanded_mse)
      .add("commanded_mse_error", step.commanded_mse_error)
      .add("recommended_mse", step.recommended_mse)
      .add("recommended_mse_error", step.recommended_mse_error);
  return line.close();
}

std::string closing_line(const TrialRecord& record, std::size_t steps) {
  LineWriter line;
  line.add("format", kFormat)
      .add("trial", record.trial)
      .add("end", record.end)
      .add("steps", std::uint64_t{steps})
      .add("budget", record.budget)
      .add("scene", record.scene)
      .add("noise_level", record.noise_level)
      .add("protocol", record.protocol)
      .add("algorithm", record.algorithm)
      .add("algorithm_id", record.algorithm_id);
  if (!record.training.empty()) line.add("method", record.method).add("training", record.training);
  line.add("instance", record.instance)
      .add("instance_seed", std::to_string(record.instance_seed))
      .raw("own_optimum_mse", record.has_own_optimum ? LineWriter::number(record.own_optimum_mse) : "null")
      .add("own_optimum_pose", record.own_optimum_pose);
  add_mtf(line, "own_optimum_mtf_", record.own_optimum_mtf);
  if (std::isfinite(record.uncured_mse)) line.add("uncured_mse", record.uncured_mse);
  add_mtf(line, "mtf_", record.mtf);
  add_mtf(line, "uncured_mtf_", record.uncured_mtf);
  if (!record.glued_mse.empty()) line.add("glued_mse", record.glued_mse).add("glued_mse_error", record.glued_mse_error);
  if (!record.best_mse.empty()) line.add("best_mse", record.best_mse).add("best_mse_error", record.best_mse_error);
  if (std::isfinite(record.best_uncured_mse)) line.add("best_uncured_mse", record.best_uncured_mse);
  add_mtf(line, "best_mtf_", record.best_mtf);
  add_mtf(line, "best_uncured_mtf_", record.best_uncured_mtf);
  add_mtf(line, "current_mtf_", record.current_mtf);
  add_mtf(line, "current_uncured_mtf_", record.current_uncured_mtf);
  for (const Criterion criterion : kCriteria)
    if (!record.criteria[criterion].empty()) line.add(criterion_name(criterion), record.criteria[criterion]);
  if (!record.criterion_optimum_pose.empty())
    line.add("criterion_optimum_pose", record.criterion_optimum_pose)
        .add("criterion_optimum_deficit", record.criterion_optimum_deficit);
  return line.add("message", record.message).add("warnings", record.warnings).close();
}

std::string to_lines(const TrialRecord& record) {
  std::string lines;
  for (const StepRecord& step : record.steps) {
    lines += step_line(record.trial, step);
    lines += '\n';
  }
  return lines + closing_line(record, record.steps.size());
}

std::string to_line(const TrialTimes& times) {
  LineWriter plugins;
  plugins.add("scene", times.plugins.scene)
      .add("noise_level", times.plugins.noise_level)
      .add("algorithm", times.plugins.algorithm);
  if (!times.plugins.prepared.empty()) plugins.add("prepared", times.plugins.prepared);
  return LineWriter()
      .add("format", kFormat)
      .add("trial", times.trial)
      .add("algorithm_seconds", times.algorithm_seconds)
      .add("simulation_seconds", times.simulation_seconds)
      .add("truth_seconds", times.truth_seconds)
      .add("harness_seconds", times.harness_seconds)
      .raw("plugins", plugins.close())
      .close();
}

void check_format(const Json& object, const std::string& what) {
  const auto found = object.is_object() ? object.find("format") : object.end();
  if (!object.is_object() || found == object.end() || !found->is_number_integer())
    throw Error(ErrorKind::bad_input, what + " has no \"format\"; expected \"format\": " + std::to_string(kFormat));
  if (found->get<std::int64_t>() > kFormat)
    throw NewerFormat(what + " has format " + found->dump() + ", which is newer than this program's " +
                      std::to_string(kFormat) + "; read it with a newer relign-bench");
  if (found->get<std::int64_t>() < 1)
    throw Error(ErrorKind::bad_input,
                what + " has the invalid format " + found->dump() + "; expected " + std::to_string(kFormat));
}

ReadLine read_trial_line(std::string_view line, const std::string& place) {
  return reading(place, [&] {
    const Json json = valid_json(line);
    ReadLine read;
    read.closing = json.contains("end");
    if (read.closing) {
      check_format(json, "the closing line");
      read.trial = read_closing(json);
      read.steps = read_whole<std::size_t>(json.at("steps"));
    } else {
      read.trial.trial = read_id(json.at("trial"));
      read.step = read_step(json);
    }
    return read;
  });
}

TrialTimes read_times_line(std::string_view line, const std::string& place) {
  return reading(place, [&] {
    const Json json = valid_json(line);
    check_format(json, "the line");
    TrialTimes times;
    times.trial = read_id(json.at("trial"));
    times.algorithm_seconds = read_numbers(json.at("algorithm_seconds"));
    times.simulation_seconds = read_numbers(json.at("simulation_seconds"));
    times.truth_seconds = read_numbers(json.at("truth_seconds"));
    times.harness_seconds = read_number(json.at("harness_seconds"));
    const Json& plugins = json.at("plugins");
    times.plugins.scene = plugins.at("scene").get<std::string>();
    times.plugins.noise_level = plugins.at("noise_level").get<std::string>();
    times.plugins.algorithm = plugins.at("algorithm").get<std::string>();
    times.plugins.prepared = plugins.value("prepared", std::string());
    return times;
  });
}

}  // namespace relign::records
