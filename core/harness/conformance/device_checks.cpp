// Checks of the devices that a scene with a score of its own draws from its uncertain quantities: whether a study on
// them would mean what its author thinks.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "base/json_source.h"
#include "base/seeds.h"
#include "base/text.h"
#include "conformance/checks.h"
#include "conformance/progress.h"
#include "plugin_host/objects.h"
#include "records/specification.h"
#include "trials/instance.h"
#include "trials/own_optimum.h"
#include "trials/protocol.h"
#include "trials/scene_facts.h"

namespace relign::conformance {

using plugin_host::MountedAssembly;
using plugin_host::Scene;
using Pose = std::vector<double>;

namespace {

constexpr std::uint64_t kSuiteSeed = 20250307;
constexpr std::uint64_t kMostDevices = 8, kFewestDevices = 2;
constexpr std::chrono::seconds kEnough(20);              // then no further device is drawn
constexpr double kStrides[] = {-0.1, -0.01, 0.01, 0.1};  // shares of the travel from the optimum
constexpr double kEdge = 1e-4;                           // of the travel
constexpr double kMeasurable = 20;                       // resolutions, from which score and reading are compared
constexpr double kSameFactor = 2;                        // between them
constexpr std::uint64_t kSeed = 1;                       // of captures and scores that are compared with each other

struct Device {
  std::string name;  // "device 3"
  trials::Perturbations drawn;
  MountedAssembly assembly;
  Pose centre;  // its optimum, or without one the nominal pose
  double score_there = 0;
};

class Devices {
 public:
  explicit Devices(const plugin_host::Choice& choice)
      : scene_(choice, check_services(1)), facts_(trials::read_scene_facts(scene_.describe(), choice.id)) {}

  const trials::SceneFacts& facts() const { return facts_; }

  Finding look(const plugin_host::Choice& declared) {
    plugin_host::NoiseLevel level(declared, check_services());
    matters_.assign(facts_.axes.size(), false);
    const auto begun = std::chrono::steady_clock::now();
    for (count_ = 0; count_ < kMostDevices; ++count_) {
      if (count_ >= kFewestDevices && std::chrono::steady_clock::now() - begun > kEnough) break;
      at("with device " + std::to_string(count_));
      trials::Instance instance = trials::draw_instance(level, facts_, kSuiteSeed, SeedDomain::tuning, count_);
      MountedAssembly assembly = scene_.mount(instance.perturbations.elements_json);
      Device device{"device " + std::to_string(count_), std::move(instance.perturbations), std::move(assembly),
                    facts_.nominal_pose};
      if (const std::string flaw = flaw_of(device); !flaw.empty()) return failed(flaw);
    }
    for (const std::string& flaw : {flaw_of_measure(ratios_, "what measures the score"),
                                    flaw_of_measure(ratios_of_captures_, "what captures measure of the score")})
      if (!flaw.empty()) return failed(flaw);
    const std::vector<std::string> doubts = all_doubts();
    return doubts.empty() ? ok(remarks()) : warning(join(doubts, "; "));
  }

 private:
  MountedAssembly::Truth score_at(Device& device, const Pose& pose) const {
    return device.assembly.noise_free_mse(pose, kSeed);
  }
  std::string with_unit(double score) const { return significant(score) + facts_.score.suffix(); }

  // Of its optimum, its score and what is around it.
  std::string flaw_of(Device& device) {
    const auto optimum = trials::own_optimum(device.assembly, facts_, kSeed);
    if (optimum) device.centre = optimum->true_pose;
    const MountedAssembly::Truth there = score_at(device, device.centre);
    device.score_there = there.mse;
    if (optimum) {
      ++optima_;
      const double error = 6 * std::hypot(there.standard_error, optimum->standard_error) + facts_.score.resolution;
      if (std::fabs(there.mse - optimum->mse) > error)
        return device.name + ": its optimum is stated to score " + with_unit(optimum->mse) + ", but scores " +
               with_unit(there.mse);
      note_place_of(device);
    }
    if (const std::string flaw = flaw_around(device, optimum.has_value(), there); !flaw.empty()) return flaw;
    if (count_ < kFewestDevices && facts_.searches_optimum && optimum) note_search(device, optimum->mse);
    if (count_ < kFewestDevices) note_quantities(device);
    const Pose& start = device.drawn.start;
    starts_.push_back(score_at(device, start).mse);
    for (std::size_t axis = 0; axis < start.size(); ++axis)
      if (std::fabs(device.centre[axis] - start[axis]) > trials::kBlindHalfBox) {
        ++outside_;
        break;
      }
    return "";
  }

  void note_place_of(const Device& device) {
    in_specification_ += device.score_there <= spec_.score;
    best_ = std::min(best_, device.score_there);
    for (std::size_t axis = 0; axis < facts_.axes.size(); ++axis)
      if (const double place = device.centre[axis];
          facts_.axes[axis].observable && (place < kEdge || place > 1 - kEdge))
        at_edge_[axis] += 1;
  }

  std::string flaw_around(Device& device, bool is_optimum, const MountedAssembly::Truth& there) {
    for (std::size_t axis = 0; axis < facts_.axes.size(); ++axis)
      for (const double stride : kStrides) {
        Pose pose = device.centre;
        pose[axis] = std::clamp(pose[axis] + stride, 0.0, 1.0);
        const MountedAssembly::Truth here = score_at(device, pose);
        const double error = 6 * std::hypot(there.standard_error, here.standard_error) + facts_.score.resolution;
        if (std::fabs(here.mse - there.mse) > error) matters_[axis] = true;
        if (is_optimum && here.mse + error < there.mse)
          return device.name + ", drawn from its uncertain quantities, scores " + with_unit(there.mse) +
                 " at its optimum, but " + with_unit(here.mse) + " where '" + facts_.axes[axis].name + "' is " +
                 significant(pose[axis]) + " instead of " + significant(device.centre[axis]);
        note_reading(device, pose, here.mse);
      }
    return "";
  }

  void note_reading(Device& device, const Pose& pose, double score) {
    if (!facts_.score_measure) return;
    std::vector<float> readings(std::size_t{facts_.image_width} * facts_.image_height);
    if (!device.assembly.render_noise_free(pose, readings.data()))
      device.assembly.capture(pose, kSeed, readings.data());
    note_ratio(readings[*facts_.score_measure], score, ratios_);
    device.assembly.capture(pose, ++frame_, readings.data());  // other noise each time
    note_ratio(readings[*facts_.score_measure], score, ratios_of_captures_);
  }

  void note_ratio(double reading, double score, std::vector<double>& ratios) const {
    const double resolution = facts_.score.resolution;
    if (std::max(reading, score) > kMeasurable * resolution) ratios.push_back(reading / std::max(score, resolution));
  }

  std::string flaw_of_measure(std::vector<double>& ratios, const std::string& what) const {
    if (ratios.empty()) return "";
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    if (*middle <= kSameFactor && *middle >= 1 / kSameFactor) return "";
    return what + " is " + significant(*middle) + " times the score (median of " + counted(ratios.size(), "pose") +
           " around the best ones); both must be the same quantity in '" + facts_.score.unit + "'";
  }

  // Searches that start elsewhere must end at the same score.
  void note_search(Device& device, double found) {
    const auto again = trials::own_optimum(device.assembly, facts_, kSeed + 1);
    const double apart = std::fabs(again->mse - found);
    if (apart > 10 * facts_.score.resolution + 0.1 * std::min(again->mse, found))
      searches_ = device.name + ": two searches for its optimum end at " + with_unit(found) + " and " +
                  with_unit(again->mse) + ", as on a plateau or among many minima; return it from own_optimum";
  }

  // Whether a device without one of its quantities differs from it.
  void note_quantities(Device& device) {
    const Json elements = parsed_json(device.drawn.elements_json);
    std::vector<Pose> poses = {device.centre, device.drawn.start};
    for (const double stride : {0.03, -0.03}) {
      Pose pose = device.centre;
      for (std::size_t axis = 0; axis < pose.size(); ++axis)
        pose[axis] = std::clamp(pose[axis] + (axis % 2 ? -stride : stride), 0.0, 1.0);
      poses.push_back(std::move(pose));
    }
    if (seen(device.assembly, device.centre, kSeed + 1) == seen(device.assembly, device.centre, kSeed) &&
        differs_from_noise_free(device))
      seeds_ =
          "captures do not depend on the frame seed, although they differ from the noise-free ones: their noise is "
          "the same in every capture";
    std::vector<std::vector<float>> captures;
    for (const Pose& pose : poses) captures.push_back(seen(device.assembly, pose));
    for (const trials::UncertainQuantity& quantity : facts_.uncertain) {
      if (known_.count(quantity.name)) continue;
      Json others = elements;
      others.erase(quantity.name);
      MountedAssembly without = scene_.mount(others.dump());
      for (std::size_t k = 0; k < poses.size(); ++k)
        if (seen(without, poses[k]) != captures[k]) known_.insert(quantity.name);
    }
  }

  bool differs_from_noise_free(Device& device) const {
    std::vector<float> exact(std::size_t{facts_.image_width} * facts_.image_height);
    if (!device.assembly.render_noise_free(device.centre, exact.data())) return false;
    std::vector<float> noisy = seen(device.assembly, device.centre);
    noisy.pop_back();
    return noisy != exact;
  }

  // A capture and the score, which follows it.
  std::vector<float> seen(MountedAssembly& assembly, const Pose& pose, std::uint64_t seed = kSeed) const {
    std::vector<float> values(std::size_t{facts_.image_width} * facts_.image_height);
    assembly.capture(pose, seed, values.data());
    values.push_back(static_cast<float>(assembly.noise_free_mse(pose, kSeed).mse));
    return values;
  }

  std::vector<std::string> all_doubts() const {
    std::vector<std::string> doubts;
    for (const std::string& doubt : {seeds_, searches_})
      if (!doubt.empty()) doubts.push_back(doubt);
    if (!std::isnan(spec_.score) && optima_ > 0 && in_specification_ == 0)
      doubts.push_back("none of " + counted(optima_, "device") +
                       " is in specification at its optimum (lowest: " + with_unit(best_) + ")");
    for (const auto& [axis, count] : at_edge_)
      if (count < optima_)
        doubts.push_back("the optimum of " + std::to_string(count) + " of " + counted(optima_, "device") +
                         " is at an end of the travel of '" + facts_.axes[axis].name + "' or beyond");
    for (std::size_t axis = 0; axis < facts_.axes.size(); ++axis)
      if (facts_.axes[axis].observable && !matters_[axis])
        doubts.push_back("the score does not depend on '" + facts_.axes[axis].name +
                         "' around the best poses; if this is meant, declare \"observable\": false");
    for (const trials::UncertainQuantity& quantity : facts_.uncertain)
      if (!known_.count(quantity.name))
        doubts.push_back("neither captures nor scores depend on the uncertain quantity '" + quantity.name + "'");
    return doubts;
  }

  // Not faults, but easily overlooked.
  std::string remarks() const {
    std::vector<std::string> remarks;
    for (const auto& [axis, count] : at_edge_)
      if (count == optima_)
        remarks.push_back("the optimum of every device is at an end of the travel of '" + facts_.axes[axis].name + "'");
    if (optima_ > 0 && outside_ > 0)
      remarks.push_back("the optimum of " + std::to_string(outside_) + " of " + counted(optima_, "device") +
                        " is outside the box that methods observe under 'blind', half of the travel to each side of "
                        "the start; a level of starts near the nominal pose keeps it inside");
    const double limit = spec_.score;
    const auto met = std::count_if(starts_.begin(), starts_.end(), [limit](double score) { return score <= limit; });
    if (2 * static_cast<std::size_t>(met) > starts_.size())
      remarks.push_back("the specification of " + with_unit(limit) + " is already met at the start of " +
                        std::to_string(met) + " of " + counted(starts_.size(), "device") +
                        ", so that yields and times to specification say little; tighten it, or start farther away");
    const auto [low, high] = std::minmax_element(starts_.begin(), starts_.end());
    if (*high - *low <= facts_.score.resolution)
      remarks.push_back("the score is " + with_unit(*low) +
                        " at the start of every device, so that methods have to search first");
    return join(remarks, "; ");
  }

  Scene scene_;
  trials::SceneFacts facts_;
  const records::Specification spec_ = records::specification_of(Json(), facts_.spec, facts_.score);
  std::uint64_t count_ = 0;  // devices so far
  std::vector<bool> matters_;
  std::vector<double> starts_;  // scores
  std::uint64_t frame_ = kSeed;
  std::vector<double> ratios_of_captures_;
  std::vector<double> ratios_;               // of what measures the score to the score
  std::set<std::string> known_;              // quantities that change something
  std::map<std::size_t, unsigned> at_edge_;  // axis: devices
  unsigned outside_ = 0;                     // devices with the optimum outside the box of the protocol "blind"
  unsigned optima_ = 0, in_specification_ = 0;
  double best_ = std::numeric_limits<double>::infinity();
  std::string searches_, seeds_;  // doubts
};

}  // namespace

Finding check_devices(const Subject& subject) {
  Devices devices(subject.choice());
  const trials::SceneFacts& facts = devices.facts();
  if (facts.owns_stage || facts.score.squared || !facts.truth)
    return skipped("it declares no score of its own, or measures real devices");
  plugin_host::Catalog installed;
  for (const std::filesystem::path& root : plugin_host::Catalog::default_roots()) installed.scan(root);
  std::vector<Problem> problems;
  const plugin_host::Choice declared =
      installed.resolve(plugin_host::Kind::noise_level, "declared", Json::object(), ".", problems);
  if (!declared.plugin) return skipped("the noise level 'declared' is not installed");
  return devices.look(declared);
}

}  // namespace relign::conformance
