#include "side_file.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

namespace relign::policies {
namespace {

using Json = nlohmann::json;

constexpr int kParitySide = 10;
constexpr int kLargestSize = 1024;
constexpr int kMaxFrames = 64;
constexpr int kMaxBlocks = 100;
constexpr double kLargestScale = 1e6;
constexpr std::size_t kMaxAxes = 64;
constexpr int kMaxSlots = 1000;
constexpr std::size_t kMaxReadings = 1000, kMaxHistory = 1 << 20;
constexpr double kLargestProbe = 10;  // in shares of the travel
constexpr std::uintmax_t kMaxSideFileBytes = 16u << 20;

[[noreturn]] void complain(const std::string& what) { throw std::runtime_error(what); }

int integer(const Json& object, const char* name, int least, int most) {
  // Read as double: a value outside the range of int cannot be converted.
  const double value = object.at(name).get<double>();
  if (!(value >= least && value <= most) || value != std::floor(value))
    complain(std::string(name) + ": must be an integer from " + std::to_string(least) + " to " + std::to_string(most) +
             ", found " + object.at(name).dump());
  return static_cast<int>(value);
}

double positive(const Json& object, const char* name) {
  const double value = object.at(name).get<double>();
  if (!std::isfinite(value) || value <= 0)
    complain(std::string(name) + ": must be a positive number, found " + object.at(name).dump());
  return value;
}

// Keys of the side file, also those that only relign-bench reads (docs/schemas/network.schema.json).
using Keys = std::vector<std::string>;
const Keys kKeys = {"use",     "format",       "scene",  "scene_sha256",   "axes",         "observation",
                    "output",  "scales",       "doubt",  "probes",         "largest_move", "command",
                    "trained", "reproducible", "parity", "weights_sha256", "reference",    "$schema"};
const std::pair<const char*, Keys> kInnerKeys[] = {
    {"observation",
     {"size", "frames", "captured", "white", "byte_whites", "values", "mean", "deviation", "rows", "kind", "readings",
      "fine", "score", "history"}},
    {"probes", {"poses", "until"}},
    {"doubt", {"directions", "effects", "floor", "drift"}},
    {"reference", {"blocks", "means", "readings"}},
    {"parity", {"inputs", "answers"}},
    {"trained",
     {"recipe", "hours", "warm_start", "adapted", "threads", "device", "steps", "instances", "torch", "machine"}}};

// A mistyped key would leave its default in force.
void refuse_unknown(const Json& object, const Keys& known, const std::string& where) {
  for (const auto& [key, value] : object.items()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    std::string allowed;
    for (const std::string& name : known) allowed += (allowed.empty() ? "" : ", ") + name;
    complain("unknown key '" + key + "'" + where + "; allowed: " + allowed);
  }
}

std::vector<float> finite_values(const Json& values, std::size_t count, const char* name) {
  const auto read = values.get<std::vector<float>>();
  if (read.size() != count)
    complain(std::string(name) + ": must have " + std::to_string(count) + " numbers, found " +
             std::to_string(read.size()));
  for (const float value : read)
    if (!std::isfinite(value)) complain(std::string(name) + ": numbers must be finite");
  return read;
}

std::vector<std::uint8_t> bytes_of(const std::string& hex, std::size_t count) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    complain("parity: inputs must be pairs of the hexadecimal digits 0 to 9 and a to f");
  };
  if (hex.size() != 2 * count)
    complain("parity: inputs must have " + std::to_string(count) + " bytes, found " + std::to_string(hex.size() / 2));
  std::vector<std::uint8_t> bytes(count);
  for (std::size_t i = 0; i < count; ++i)
    bytes[i] = static_cast<std::uint8_t>(16 * digit(hex[2 * i]) + digit(hex[2 * i + 1]));
  return bytes;
}

std::vector<double> finite_doubles(const Json& values, std::size_t count, const char* name, double least) {
  const auto read = values.get<std::vector<double>>();
  if (read.size() != count)
    complain(std::string(name) + ": must have " + std::to_string(count) + " numbers, found " +
             std::to_string(read.size()));
  for (const double value : read)
    if (!std::isfinite(value) || value < least) complain(std::string(name) + ": found " + std::to_string(value));
  return read;
}

Doubt doubt_of(const Json& json, std::size_t axes) {
  Doubt doubt;
  const Json& directions = json.at("directions");
  if (!directions.is_array() || directions.size() != axes)
    complain("doubt.directions: must have " + std::to_string(axes) + " directions");
  for (const Json& direction : directions)
    doubt.directions.push_back(finite_doubles(direction, axes, "doubt.directions", -2));
  doubt.effects = finite_doubles(json.at("effects"), axes, "doubt.effects", 0);
  doubt.floor = finite_doubles(json.at("floor"), axes, "doubt.floor", 0);
  doubt.drift = json.at("drift").get<double>();
  if (!(doubt.drift >= 0 && doubt.drift <= 1)) complain("doubt.drift: must be from 0 to 1");
  return doubt;
}

void read_images(const Json& observation, SideFile& side) {
  side.size = integer(observation, "size", kParitySide, kLargestSize);
  if (observation.contains("rows")) side.rows = integer(observation, "rows", kParitySide, kLargestSize);
  side.frames = integer(observation, "frames", 1, kMaxFrames);
  side.white = positive(observation, "white");
  side.byte_whites = positive(observation, "byte_whites");
  const auto values = observation.value("values", std::string("bytes"));
  if (values != "bytes" && values != "irradiance")
    complain("values: must be 'bytes' or 'irradiance', found '" + values + "'");
  side.irradiance = values == "irradiance";
  if (observation.contains("readings")) return;  // the others are theirs
  side.mean = observation.value("mean", 0.0);
  if (!std::isfinite(side.mean)) complain("mean: must be finite");
  if (observation.contains("deviation")) side.deviation = positive(observation, "deviation");
}

std::vector<double> positive_doubles(const Json& values, std::size_t count, const char* name) {
  const std::vector<double> read = finite_doubles(values, count, name, 0);
  for (const double value : read)
    if (value == 0) complain(std::string(name) + ": must be positive");
  return read;
}

HistoryFormat history_of(const Json& observation, const SideFile& side) {
  HistoryFormat format;
  format.axes = side.axes.size();
  const Json& history = observation.at("history");
  refuse_unknown(history, {"last", "best", "fine_move"}, " in 'history'");
  format.last = integer(history, "last", 1, kMaxSlots);
  format.best = integer(history, "best", 0, kMaxSlots);
  format.fine_move = positive(history, "fine_move");
  if (side.frames == 0 || observation.contains("readings")) {
    for (const Json& reading : observation.at("readings")) {
      refuse_unknown(reading, {"name", "unit"}, " in 'readings'");
      format.readings.push_back(reading.at("name").get<std::string>());
      format.units.push_back(reading.value("unit", std::string()));
    }
    const std::size_t count = format.readings.size();
    if (count < 1 || count > kMaxReadings)
      complain("readings: must be 1 to " + std::to_string(kMaxReadings) + ", found " + std::to_string(count));
    format.mean = finite_doubles(observation.at("mean"), count, "mean", std::numeric_limits<double>::lowest());
    format.deviation = positive_doubles(observation.at("deviation"), count, "deviation");
    format.fine = positive_doubles(observation.at("fine"), count, "fine");
    if (observation.contains("score")) {
      const auto name = observation.at("score").get<std::string>();
      const auto found = std::find(format.readings.begin(), format.readings.end(), name);
      if (found == format.readings.end()) complain("score: '" + name + "' is not one of the readings");
      format.score = static_cast<int>(found - format.readings.begin());
    }
  }
  if (format.best > 0 && format.score < 0) complain("history.best: requires a reading that measures the score");
  if (format.count() > kMaxHistory)
    complain("history: must be at most " + std::to_string(kMaxHistory) + " numbers, found " +
             std::to_string(format.count()));
  return format;
}

Probes probes_of(const Json& json, const SideFile& side) {
  if (!side.history || side.history->score < 0) complain("probes: require a reading that measures the score");
  Probes probes;
  for (const Json& pose : json.at("poses"))
    probes.poses.push_back(finite_doubles(pose, side.axes.size(), "probes.poses", -kLargestProbe));
  if (probes.poses.empty() || probes.poses.size() > kMaxSlots)
    complain("probes.poses: must be 1 to " + std::to_string(kMaxSlots) + ", found " +
             std::to_string(probes.poses.size()));
  probes.until = json.at("until").get<double>();
  if (!std::isfinite(probes.until)) complain("probes.until: must be finite");
  return probes;
}

SideFile parse(const Json& json) {
  SideFile side;
  if (json.at("format").get<double>() != 1) complain("format: must be 1, found " + json.at("format").dump());
  refuse_unknown(json, kKeys, "");
  for (const auto& [name, known] : kInnerKeys)
    if (json.contains(name) && json[name].is_object())
      refuse_unknown(json[name], known, " in '" + std::string(name) + "'");
  side.scene = json.at("scene").get<std::string>();
  side.axes = json.at("axes").get<std::vector<std::string>>();
  if (side.axes.empty() || side.axes.size() > kMaxAxes)
    complain("axes: must have 1 to 64 names, found " + std::to_string(side.axes.size()));
  const Json& observation = json.at("observation");
  const auto kind = observation.value("kind", std::string("images"));
  if (kind != "images" && kind != "readings") complain("kind: must be 'images' or 'readings', found '" + kind + "'");
  if (kind == "images")
    read_images(observation, side);
  else
    side.frames = 0;
  if (kind == "readings" || observation.contains("readings") || observation.contains("history"))
    side.history = history_of(observation, side);
  if (json.contains("scales"))
    side.scales = finite_doubles(json.at("scales"), side.axes.size(), "scales", -kLargestScale);
  const auto output = json.at("output").get<std::string>();
  if (output != "way" && output != "move") complain("output: must be 'way' or 'move', found '" + output + "'");
  side.displacement = output == "way";
  if (json.contains("doubt")) {
    if (!side.displacement) complain("doubt: requires output 'way', found '" + output + "'");
    if (!side.scales.empty()) complain("doubt: cannot be combined with 'scales'");
    side.doubt = doubt_of(json.at("doubt"), side.axes.size());
  }
  if (json.contains("largest_move")) side.largest_move = positive(json, "largest_move");
  if (json.contains("probes")) side.probes = probes_of(json.at("probes"), side);
  if (side.history && (side.doubt || !side.scales.empty()))
    complain("history: cannot be combined with 'doubt' or 'scales'");
  if (!side.history && side.largest_move > 0) complain("largest_move: requires 'history' in 'observation'");
  // Added after format 1 was first written: the default is "anywhere".
  const auto reproducible = json.value("reproducible", std::string("anywhere"));
  if (reproducible != "anywhere" && reproducible != "this_cpu")
    complain("reproducible: must be 'anywhere' or 'this_cpu', found '" + reproducible + "'");
  side.portable = reproducible == "anywhere";
  side.weights_sha256 = json.at("weights_sha256").get<std::string>();
  side.command = json.at("command").get<std::string>();
  const Json& reference = json.at("reference");
  if (kind == "readings") {
    side.reference = finite_values(reference.at("readings"), side.history->readings.size(), "reference.readings");
  } else {
    side.blocks = integer(reference, "blocks", 1, kMaxBlocks);
    const auto count = static_cast<std::size_t>(side.blocks) * static_cast<std::size_t>(side.blocks);
    side.reference = finite_values(reference.at("means"), count, "reference");
  }
  const Json& parity = json.at("parity");
  const Json& inputs = parity.at("inputs");
  const Json& answers = parity.at("answers");
  if (!inputs.is_array() || !answers.is_array() || inputs.empty() || inputs.size() != answers.size())
    complain("parity: must have as many answers as inputs, and at least one");
  const std::size_t bytes =
      static_cast<std::size_t>(side.frames) * kParitySide * kParitySide + (side.history ? side.history->count() : 0);
  for (std::size_t i = 0; i < inputs.size(); ++i)
    side.parity.push_back(
        {bytes_of(inputs[i].get<std::string>(), bytes), finite_values(answers[i], side.outputs(), "parity")});
  return side;
}

}  // namespace

InputShape SideFile::shape() const { return {frames, size, rows, history ? static_cast<int>(history->count()) : 0}; }

std::vector<float> SideFile::shown(const Parity& input) const {
  const auto unit = irradiance ? static_cast<float>(byte_whites * white / 255) : 1.0F;
  const int down = rows > 0 ? rows : size;
  std::vector<float> values;
  for (int frame = 0; frame < frames; ++frame)
    for (int y = 0; y < down; ++y)
      for (int x = 0; x < size; ++x) {
        const int block = (frame * kParitySide + y * kParitySide / down) * kParitySide + x * kParitySide / size;
        values.push_back(unit * static_cast<float>(input.bytes[static_cast<std::size_t>(block)]));
      }
  for (auto k = static_cast<std::size_t>(frames) * kParitySide * kParitySide; k < input.bytes.size(); ++k)
    values.push_back((static_cast<float>(input.bytes[k]) - 128) / 32);
  return values;
}

namespace {

// Of a key that is there twice, readers take the first or the last.
Json read_json(std::istream& file) {
  std::vector<std::set<std::string>> keys;  // of the open objects
  return Json::parse(file, [&keys](int, Json::parse_event_t event, Json& value) {
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key && !keys.back().insert(value.get<std::string>()).second)
      complain("duplicate key '" + value.get<std::string>() + "'");
    return true;
  });
}

}  // namespace

SideFile read_side_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw std::runtime_error(path + ": file not found; relign-train writes it beside the network, keep both together");
  if (std::filesystem::file_size(path) > kMaxSideFileBytes)
    throw std::runtime_error(path + ": larger than 16 MiB, not a side file of relign-train");
  try {
    return parse(read_json(file));
  } catch (const Json::exception& error) {
    const std::string text = error.what();  // "[json.exception.out_of_range.403] key 'scales' not found"
    const std::size_t bracket = text.find("] ");
    throw std::runtime_error(path + ": not a side file of relign-train (" +
                             (bracket == std::string::npos ? text : text.substr(bracket + 2)) + ")");
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

}  // namespace relign::policies
