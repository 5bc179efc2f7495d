#include "records/record.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include <type_traits>

#include "base/fault.h"
#include "base/files.h"
#include "base/limits.h"
#include "base/text.h"
#include "records/trial_ends.h"

namespace relign::records {
namespace {

// Writes one JSON object with its keys in the order they are added (nlohmann::json sorts them), so that a line starts
// with the trial's id.
class LineWriter {
 public:
  LineWriter& add(std::string_view key, double value) { return raw(key, number(value)); }
  LineWriter& add(std::string_view key, std::uint64_t value) { return raw(key, std::to_string(value)); }
  LineWriter& add(std::string_view key, unsigned value) { return raw(key, std::to_string(value)); }
  LineWriter& add(std::string_view key, int value) { return raw(key, std::to_string(value)); }
  LineWriter& add(std::string_view key, const std::string& value) { return raw(key, text(value)); }
  LineWriter& add(std::string_view key, const std::vector<double>& values) {
    std::string list;
    for (const double value : values) {
      if (!list.empty()) list += ',';
      list += number(value);
    }
    return raw(key, "[" + list + "]");
  }
  LineWriter& add(std::string_view key, const PixelRegions& regions) { return raw(key, to_json_text(regions)); }
  LineWriter& add(std::string_view key, const std::vector<std::string>& values) {
    std::string list;
    for (const std::string& value : values) {
      if (!list.empty()) list += ',';
      list += text(value);
    }
    return raw(key, "[" + list + "]");
  }
  LineWriter& raw(std::string_view key, const std::string& json) {
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

struct ColumnWriter {
  LineWriter& line;
  template <class Value>
  void operator()(const Column& column, const Value& value) {
    if (column.is(kOptional) && !is_known(value)) return;
    if constexpr (std::is_same_v<Value, std::uint64_t>)
      if (column.is(kAsText)) return void(line.add(column.key, std::to_string(value)));
    line.add(column.key, value);
  }
};

double read_number(const Json& value) { return value.is_null() ? kUnknown : value.get<double>(); }

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

void read(const Json& json, double& value) { value = read_number(json); }
void read(const Json& json, std::vector<double>& values) { values = read_numbers(json); }
void read(const Json& json, unsigned& steps) { steps = read_steps(json); }
void read(const Json& json, std::uint64_t& value) { value = read_whole<std::uint64_t>(json); }
void read(const Json& json, PixelRegions& regions) { regions = read_regions(json); }
template <class Text>  // or a list of them
void read(const Json& json, Text& text) {
  text = json.get<Text>();
}

struct ColumnReader {
  const Json& line;
  template <class Value>
  void operator()(const Column& column, Value& value) {
    const std::string key(column.key);
    if (column.is(kOptional) && !line.contains(key)) return;
    const Json& json = line.at(key);
    if constexpr (std::is_same_v<Value, std::uint64_t>)
      if (column.is(kAsText)) return void(value = read_seed(json.get<std::string>()));
    read(json, value);
    if constexpr (std::is_same_v<Value, std::vector<double>>)
      if (column.is(kPerStep) && value.size() != line.at("steps").get<std::size_t>())
        throw Error(ErrorKind::bad_input,
                    key + " has " + std::to_string(value.size()) + " values for " + line.at("steps").dump() + " steps");
  }
};

// The keys that a line may have.
const std::set<std::string>& known_keys(bool closing) {
  static const auto keys_of = [](bool of_closing) {
    std::set<std::string> keys = {"trial"};
    const auto add = [&keys](const Column& column) { keys.emplace(column.key); };
    if (of_closing) {
      keys.insert({"format", "end", "steps", "sha256"});
      trial_columns(add);
    } else {
      step_columns(add);
    }
    return keys;
  };
  static const std::set<std::string> of_step = keys_of(false), of_closing = keys_of(true);
  return closing ? of_closing : of_step;
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

bool ended_well(const std::string& end) {
  return std::any_of(kTrialEnds.begin(), kTrialEnds.begin() + kGoodEnds,
                     [&end](const Explanation& good) { return good.code == end; });
}

std::array<double, kTabledColumns> tabled_values(const StepRecord& step) {
  std::array<double, kTabledColumns> values = {};
  step_columns(
      [&, place = std::size_t{0}](const Column& column, const auto& value) mutable {
        if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(value)>>)
          if (column.is(kTabled)) values[place++] = static_cast<double>(value);
      },
      step);
  return values;
}

std::vector<std::pair<std::string, double>> tabled_values(const TrialRecord& trial) {
  std::vector<std::pair<std::string, double>> values;
  trial_columns(
      [&values](const Column& column, const auto& value) {
        if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(value)>>)
          if (column.is(kTabled)) values.emplace_back(column.key, static_cast<double>(value));
      },
      trial);
  return values;
}

std::string step_line(const std::string& trial, const StepRecord& step) {
  LineWriter line;
  line.add("trial", trial);
  step_columns(ColumnWriter{line}, step);
  return line.close();
}

std::string closing_line(const TrialRecord& record, std::size_t steps) {
  LineWriter line;
  line.add("format", kFormat).add("trial", record.trial).add("end", record.end).add("steps", std::uint64_t{steps});
  trial_columns(ColumnWriter{line}, record);
  return line.close();
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

Json read_formatted(const std::filesystem::path& file) {
  std::error_code code;
  if (!std::filesystem::exists(file, code)) return nullptr;
  Json json;
  try {
    json = valid_json(read_file(file));
  } catch (const Error& error) {
    throw Error(ErrorKind::bad_input, file.string() + " is damaged: " + error.what());
  }
  check_format(json, file.string());
  return json;
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
    if (read.closing) check_format(json, "the closing line");
    read.trial.trial = read_id(json.at("trial"));
    if (read.closing) {
      read.trial.end = json.at("end").get<std::string>();
      read.steps = read_whole<std::size_t>(json.at("steps"));
      trial_columns(ColumnReader{json}, read.trial);
    } else {
      step_columns(ColumnReader{json}, read.step);
    }
    for (const auto& [key, value] : json.items())
      if (!known_keys(read.closing).count(key))
        throw Error(ErrorKind::bad_input, "it has " + in_quotes(key) +
                                              ", which this version does not write; if a newer relign-bench wrote it, "
                                              "read it with that");
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
