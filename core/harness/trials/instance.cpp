#include "trials/instance.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <relign/random.hpp>

#include "base/text.h"

namespace relign::trials {
namespace {

std::vector<double> read_start(ObjectReader& top, std::size_t axes) {
  const std::vector<double> start = top.numbers("start", axes, {});
  if (!top.has("start")) top.complain_missing("start", "the true start pose");
  for (std::size_t i = 0; i < start.size(); ++i)
    if (!(start[i] >= 0 && start[i] <= 1))
      top.complain("start",
                   "value " + std::to_string(i) + " is " + shortest(start[i]) + "; expected 0 to 1 on every axis");
  return start;
}

std::vector<double> read_distortion(ObjectReader& top, std::size_t axes) {
  const Json* rows = top.get("distortion");
  const std::string wanted =
      "expected " + std::to_string(axes) + " rows of " + std::to_string(axes) + " numbers under 'distortion'";
  std::vector<double> matrix;
  bool fits = rows && rows->is_array() && rows->size() == axes;
  for (std::size_t i = 0; fits && i < axes; ++i) {
    const Json& row = rows->at(i);
    fits = row.is_array() && row.size() == axes;
    for (std::size_t j = 0; fits && j < axes; ++j) {
      fits = row.at(j).is_number();
      if (fits) matrix.push_back(row.at(j).get<double>());
    }
  }
  if (!fits) {
    top.complain("distortion", wanted);
    return {};
  }
  // Without an inverse, no command would move one axis alone; real stages have one.
  const auto size = static_cast<Eigen::Index>(axes);
  const Eigen::FullPivLU<Eigen::MatrixXd> factors(
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(matrix.data(), size,
                                                                                               size));
  if (!factors.isInvertible() || !(factors.rcond() > 1e-9))
    top.complain("distortion", "the matrix is singular or nearly so; expected one with a usable inverse");
  return matrix;
}

std::vector<double> read_shares(ObjectReader& reader, const char* key, std::size_t axes, double lowest) {
  const std::vector<double> values = reader.numbers(key, axes, std::vector<double>(axes, 0.0));
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!(values[i] >= lowest && values[i] <= 1))
      reader.complain(key, "value " + std::to_string(i) + " is " + shortest(values[i]) + "; expected " +
                               shortest(lowest) + " to 1 (fractions of the travel)");
  return values;
}

// Empty if all errors are 0.
std::optional<StageErrors> read_stage(const JsonSource& source, ObjectReader& top, std::size_t axes,
                                      std::vector<Problem>& problems) {
  if (!top.get("stage")) return std::nullopt;
  ObjectReader reader(source, "/stage", problems);
  StageErrors stage;
  stage.backlash = read_shares(reader, "backlash", axes, 0);
  stage.repeatability = read_shares(reader, "repeatability", axes, 0);
  stage.encoder_step = read_shares(reader, "encoder_step", axes, 0);
  stage.drift = read_shares(reader, "drift", axes, -1);
  const auto all_zero = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return value == 0; });
  };
  if (!all_zero(stage.drift) && !reader.has("drift_seconds"))
    reader.complain_missing("drift_seconds", "the time constant of 'drift'");
  stage.drift_seconds = reader.number("drift_seconds", 1, 1e-3, 1e9);
  reader.reject_unknown();
  if (all_zero(stage.backlash) && all_zero(stage.repeatability) && all_zero(stage.encoder_step) &&
      all_zero(stage.drift))
    return std::nullopt;
  return stage;
}

std::optional<ModuleBatch> read_batch(const JsonSource& source, ObjectReader& top, std::size_t axes,
                                      std::vector<Problem>& problems) {
  if (!top.get("batch")) return std::nullopt;
  constexpr std::int64_t kMaxBatch = 1000;
  ObjectReader reader(source, "/batch", problems);
  ModuleBatch batch;
  if (!reader.has("size")) reader.complain_missing("size", "the number of modules in a batch");
  batch.size = static_cast<std::uint32_t>(reader.integer("size", 1, 1, kMaxBatch));
  batch.cure_shift = reader.numbers("cure_shift", axes, std::vector<double>(axes, 0.0));
  batch.inspection = read_shares(reader, "inspection", axes, 0);
  reader.reject_unknown();
  return batch;
}

Perturbations read(const JsonSource& source, const SceneFacts& scene) {
  std::vector<Problem> problems;
  ObjectReader top(source, "", problems);
  throw_if_any(problems);
  Perturbations perturbations;
  perturbations.start = read_start(top, scene.axes.size());
  perturbations.distortion = read_distortion(top, scene.axes.size());
  perturbations.elements_json = canonical_json(read_elements(source, top, scene, problems));
  perturbations.cure_shift = top.numbers("cure_shift", scene.axes.size(), {});
  perturbations.stage = read_stage(source, top, scene.axes.size(), problems);
  perturbations.batch = read_batch(source, top, scene.axes.size(), problems);
  top.reject_unknown();
  throw_if_any(problems);
  return perturbations;
}

}  // namespace

Json read_elements(const JsonSource& source, ObjectReader& top, const SceneFacts& scene,
                   std::vector<Problem>& problems) {
  Json elements = Json::object();
  const Json* given = top.get("elements");
  if (!given) {
    top.complain_missing("elements", "{} for a perfect lens");
    return elements;
  }
  ObjectReader all(source, "/elements", problems);
  if (!given->is_object()) return elements;
  std::vector<std::string> names = scene.elements;
  for (const std::string& name : scene.elements) {
    if (!all.get(name)) continue;
    ObjectReader element(source, all.pointer_to(name), problems);
    const std::vector<double> shift_mm = element.numbers("shift_mm", 3, {0, 0, 0});
    const std::vector<double> tilt_deg = element.numbers("tilt_deg", 2, {0, 0});
    element.reject_unknown();
    elements[name] = {{"shift_mm", shift_mm}, {"tilt_deg", tilt_deg}};
  }
  for (const UncertainQuantity& quantity : scene.uncertain) {
    names.push_back(quantity.name);
    if (!all.get(quantity.name)) continue;
    ObjectReader one(source, all.pointer_to(quantity.name), problems);
    constexpr double kMost = std::numeric_limits<double>::max();
    elements[quantity.name] = {{"value", one.required_number("value", -kMost, kMost)}};
    one.reject_unknown();
  }
  for (const auto& [name, value] : given->items())
    if (std::find(names.begin(), names.end(), name) == names.end())
      all.complain(name, "scene '" + scene.name + "' has no element '" + name + "'" + suggestion(name, names));
  return elements;
}

Perturbations read_perturbations(const std::string& drawn, const SceneFacts& scene, const std::string& level_id) {
  try {
    return read(JsonSource::from_text(drawn, "perturbations"), scene);
  } catch (const Error& error) {
    const std::string who = level_id.empty() ? "the noise level" : "noise level '" + level_id + "'";
    throw Error(ErrorKind::plugin_failed, who + " drew unusable perturbations:\n" + error.what());
  }
}

std::string read_offsets(const std::string& offsets_json, const SceneFacts& scene) {
  const JsonSource given = JsonSource::from_text(offsets_json, "offsets");
  const JsonSource source = JsonSource::from_text(Json{{"elements", given.root()}}.dump(), "offsets");
  std::vector<Problem> problems;
  ObjectReader top(source, "", problems);
  const Json elements = read_elements(source, top, scene, problems);
  throw_if_any(problems);
  return canonical_json(elements);
}

Instance draw_instance(plugin_host::NoiseLevel& level, const SceneFacts& scene, std::uint64_t suite_seed,
                       SeedDomain domain, std::uint64_t number) {
  Instance instance;
  instance.number = number;
  instance.suite_seed = suite_seed;
  instance.domain = domain;
  instance.seed = instance_seed(suite_seed, domain, number);
  Perturbations& drawn = instance.perturbations = read_perturbations(level.draw(instance.seed, scene.text), scene, "");
  if (!drawn.batch) return instance;
  const std::uint64_t seed = batch_seed(suite_seed, domain, number / drawn.batch->size);
  const std::optional<ModuleBatch> shared = read_perturbations(level.draw(seed, scene.text), scene, "").batch;
  if (!shared || shared->size != drawn.batch->size)
    throw Error(ErrorKind::plugin_failed,
                "the noise level drew batches of different sizes; expected one for all draws");
  drawn.batch = shared;
  drawn.cure_shift.resize(scene.axes.size(), 0.0);
  for (std::size_t i = 0; i < drawn.cure_shift.size(); ++i) drawn.cure_shift[i] += shared->cure_shift[i];
  return instance;
}

std::uint32_t earlier_modules(const Instance& instance) {
  const std::optional<ModuleBatch>& batch = instance.perturbations.batch;
  return batch ? static_cast<std::uint32_t>(instance.number % batch->size) : 0;
}

std::vector<double> inspected_shift(plugin_host::NoiseLevel& level, const SceneFacts& scene, const Instance& instance,
                                    std::uint32_t back) {
  if (back < 1 || back > earlier_modules(instance))
    throw Error(ErrorKind::internal, "the batch has no such module before this one");
  const std::uint64_t seed = instance_seed(instance.suite_seed, instance.domain, instance.number - back);
  std::vector<double> shift = read_perturbations(level.draw(seed, scene.text), scene, "").cure_shift;
  shift.resize(scene.axes.size(), 0.0);
  const ModuleBatch& batch = *instance.perturbations.batch;
  Random errors(frame_seed(seed, 0, FrameStream::inspection));
  for (std::size_t i = 0; i < shift.size(); ++i)
    shift[i] += batch.cure_shift[i] + batch.inspection[i] * errors.normal();
  return shift;
}

Instance draw_instance(const plugin_host::Choice& level, const std::string& level_name, const SceneFacts& scene,
                       const std::string& scene_name, const plugin_host::HostServices& services,
                       std::uint64_t suite_seed, std::uint64_t number) {
  try {
    plugin_host::NoiseLevel made(level, services);
    return draw_instance(made, scene, suite_seed, SeedDomain::benchmark, number);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::plugin_failed) throw;
    throw Error(ErrorKind::bad_input,
                "noise level '" + level_name + "' cannot be used with scene '" + scene_name + "': " + error.what());
  }
}

}  // namespace relign::trials
