// Checks of scenes: images and ground truth that are functions of their arguments, in every process.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "base/text.h"
#include "conformance/checks.h"
#include "conformance/conduct.h"
#include "conformance/progress.h"
#include "plugin_host/objects.h"
#include "trials/model_scene.h"
#include "trials/own_optimum.h"
#include "trials/scene_facts.h"

namespace relign::conformance {

using plugin_host::Choice;
using plugin_host::MountedAssembly;
using plugin_host::Scene;

namespace {

struct Opened {
  explicit Opened(const Choice& choice, unsigned threads = 1)
      : scene(choice, check_services(threads)), facts(trials::read_scene_facts(scene.describe(), choice.id)) {}

  std::vector<float> capture(MountedAssembly& assembly, const std::vector<double>& pose, std::uint64_t seed) const {
    // Filled with NaN, so that missing pixels are found.
    std::vector<float> pixels(std::size_t{facts.image_width} * facts.image_height, std::nanf(""));
    assembly.capture(pose, seed, pixels.data());
    return pixels;
  }
  std::vector<double> pose_near_nominal(double away) const {
    std::vector<double> pose = facts.nominal_pose;
    for (std::size_t axis = 0; axis < pose.size(); ++axis) pose[axis] += axis % 2 ? -away : away;
    return pose;
  }
  // Offsets of the last element, for checks without a noise level.
  std::string offsets() const {
    if (facts.elements.empty()) return "{}";
    return Json{{facts.elements.back(), {{"shift_mm", {0.001, -0.002, 0.0005}}, {"tilt_deg", {0.1, -0.05}}}}}.dump();
  }

  Scene scene;
  trials::SceneFacts facts;
};

const char* const kStation = "it is a station, whose images are measured, not computed";

// Compares bits, so that NaN equals NaN and 0 differs from -0.
bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

bool all_finite(const std::vector<float>& pixels) {
  return std::all_of(pixels.begin(), pixels.end(), [](float value) { return std::isfinite(value); });
}

double mean_square_difference(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (double{a[i]} - double{b[i]}) * (double{a[i]} - double{b[i]});
  return sum / static_cast<double>(a.size());
}

}  // namespace

Finding check_description(const Subject& subject) {
  for (const Choice& choice : subject.choices) {
    at("'" + choice.id + "'");
    Opened opened(choice);
    if (opened.scene.describe() != opened.facts.text) return failed("its description changes when called again");
    if (opened.facts.owns_stage) continue;  // one object at a time
    if (Opened(choice).facts.text != opened.facts.text)
      return failed("a second object has another description; it must depend only on the parameters");
    trials::ModelScene(opened.scene, choice, check_services()).get(opened.facts);  // throws unless it fits
  }
  return ok();
}

Finding check_reference(const Subject& subject) {
  Opened opened(subject.choice());
  const relign_image image = opened.scene.reference();
  if (image.width != opened.facts.image_width || image.height != opened.facts.image_height)
    return failed("the reference image has " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                  " pixels; expected " + std::to_string(opened.facts.image_width) + " x " +
                  std::to_string(opened.facts.image_height));
  const std::vector<float> pixels = packed(image);
  if (!all_finite(pixels)) return failed("the reference image has non-finite pixels");
  if (opened.facts.owns_stage) return ok();  // one object at a time
  Opened second(subject.choice());
  if (!same_bits(pixels, packed(second.scene.reference())))
    return failed("a second object has another reference image");
  return ok();
}

namespace {

// Of captures of two regions that overlap, against the whole capture with seed 11 at the same pose.
std::string flaw_of_regions(const Opened& opened, MountedAssembly& assembly, const std::vector<double>& pose,
                            const std::vector<float>& whole) {
  const std::uint32_t width = opened.facts.image_width, height = opened.facts.image_height;
  const PixelRegions regions = {{width / 4, height / 3, (width + 1) / 2, (height + 2) / 3},
                                {width / 2, height / 2, width - width / 2, height - height / 2}};
  std::vector<float> pixels(whole.size(), std::nanf(""));
  assembly.capture_regions(pose, 11, plugin_host::regions_of(regions), pixels.data());
  for (const PixelSpan& span : spans_of(regions, width))
    if (std::memcmp(pixels.data() + span.first, whole.data() + span.first, span.count * sizeof(float)) != 0)
      return "a capture of regions has other pixels there than the whole capture with the same pose and seed";
  return "";
}

// Of ground truth in a batch on a GPU, against single values, for the first choice that a GPU here supports.
std::string flaw_of_batches(const Subject& subject) {
  for (const Choice& choice : subject.choices) {
    Opened opened(choice);
    if (opened.facts.owns_stage || !opened.facts.truth || !opened.scene.open_gpu().empty()) continue;
    MountedAssembly assembly = opened.scene.mount(opened.offsets());
    const std::vector<double> pose = opened.pose_near_nominal(0.02);
    Scene::Batch batch{{&assembly, &assembly}, pose, {21, 22}};
    batch.true_poses.insert(batch.true_poses.end(), pose.begin(), pose.end());
    const std::vector<MountedAssembly::Truth> truths = opened.scene.mse_batch(batch);
    for (std::size_t i = 0; i < truths.size(); ++i) {
      const MountedAssembly::Truth one = assembly.noise_free_mse(pose, batch.seeds[i]);
      if (truths[i].mse != one.mse || truths[i].standard_error != one.standard_error)
        return "ground truth in a batch on the GPU differs from that of the same assembly, pose and seed alone";
    }
    return "";
  }
  return "";
}

}  // namespace

Finding check_same_pixels(const Subject& subject) {
  Opened opened(subject.choice());
  if (opened.facts.owns_stage) return skipped(kStation);
  const std::vector<double> pose = opened.pose_near_nominal(0.02);
  const std::vector<double> elsewhere = opened.pose_near_nominal(-0.05);
  MountedAssembly assembly = opened.scene.mount(opened.offsets());
  const std::vector<float> first = opened.capture(assembly, pose, 11);
  if (!all_finite(first)) return failed("a capture has non-finite or missing pixels");
  if (!all_finite(opened.capture(assembly, elsewhere, 12))) return failed("a capture has non-finite or missing pixels");
  assembly.noise_free_mse(elsewhere, 13);
  if (!same_bits(first, opened.capture(assembly, pose, 11)))
    return failed(
        "the same pose and seed give another image after other captures; an image must depend only on "
        "assembly, pose and frame seed");
  if (assembly.captures_regions()) {
    const std::string flaw = flaw_of_regions(opened, assembly, pose, first);
    if (!flaw.empty()) return failed(flaw);
  }
  if (const std::string flaw = flaw_of_batches(subject); !flaw.empty()) return failed(flaw);
  Opened second(subject.choice(), 3);
  MountedAssembly other = second.scene.mount("{}");
  second.capture(other, elsewhere, 14);
  MountedAssembly twin = second.scene.mount(second.offsets());
  if (!same_bits(first, second.capture(twin, pose, 11)))
    return failed("a second object with other threads gives another image for the same assembly, pose and frame seed");
  return ok();
}

// Of a score that the scene declares: in its unit, and lower where the perfect device is better. Empty if none.
static std::string flaw_of_score(Opened& opened, MountedAssembly& perfect) {
  const trials::SceneFacts& facts = opened.facts;
  const SceneScore& score = facts.score;
  const double best = perfect.noise_free_mse(facts.nominal_pose, 1).mse;
  if (best < -score.resolution)
    return "the score at the nominal pose is " + significant(best) + ", but scores are from 0";
  for (const double away : {0.3, -0.3}) {
    std::vector<double> pose = opened.pose_near_nominal(away);
    for (double& coordinate : pose) coordinate = std::clamp(coordinate, 0.0, 1.0);
    if (const double there = perfect.noise_free_mse(pose, 2).mse; there < best - score.resolution)
      return "the perfect device scores " + significant(best) + score.suffix() + " at its nominal pose, but " +
             significant(there) + score.suffix() +
             " far from it, although the lower score is the better; declare what is missing, such as 1 - visibility";
  }
  std::vector<float> readings(std::size_t{facts.image_width} * facts.image_height);
  if (!facts.score_measure || !perfect.render_noise_free(facts.nominal_pose, readings.data())) return "";
  const double reading = readings[*facts.score_measure];
  constexpr double kAllowed = 0.5, kResolutions = 10;
  if (!(std::fabs(reading - best) <= kAllowed * std::max(std::fabs(reading), best) + kResolutions * score.resolution))
    return "its noise-free reading '" + facts.score_reading() + "' is " + significant(reading) + score.suffix() +
           " at the nominal pose, but the score there is " + significant(best) + score.suffix();
  return "";
}

Finding check_truth(const Subject& subject) {
  constexpr int kSeeds = 16;
  Opened opened(subject.choice());
  if (opened.facts.owns_stage) return skipped(kStation);
  if (!opened.facts.truth) return skipped("it has no ground truth");
  MountedAssembly assembly = opened.scene.mount("{}");
  const std::vector<double> pose = opened.pose_near_nominal(0.03);
  double mean = 0;
  double stated_variance = 0;
  std::vector<double> values;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const MountedAssembly::Truth truth = assembly.noise_free_mse(pose, static_cast<std::uint64_t>(seed));
    mean += truth.mse / kSeeds;
    values.push_back(truth.mse);
    stated_variance += truth.standard_error * truth.standard_error / kSeeds;
  }
  const MountedAssembly::Truth once = assembly.noise_free_mse(pose, 1);
  const MountedAssembly::Truth again = assembly.noise_free_mse(pose, 1);
  if (once.mse != again.mse || once.standard_error != again.standard_error)
    return failed("the same pose and seed give another ground truth");
  double variance = 0;
  for (const double value : values) variance += (value - mean) * (value - mean) / kSeeds;
  const double spread = std::sqrt(variance);
  const double stated = std::sqrt(stated_variance);
  // A standard error of 0 is valid for an exact ground truth, which must not depend on the seed.
  if (stated == 0 && spread > 1e-12 * std::fabs(mean))
    return failed("its ground truth varies by " + significant(spread) +
                  " between seeds, but the stated standard error is 0");
  if (spread > 4 * stated + 1e-12 * std::fabs(mean))
    return failed("its ground truth scatters by " + significant(spread) + ", " + significant(spread / stated) +
                  " times the stated standard error");

  if (!opened.facts.score.squared) {
    const std::string flaw = flaw_of_score(opened, assembly);
    return flaw.empty() ? ok() : failed(flaw);
  }
  std::vector<float> picture(std::size_t{opened.facts.image_width} * opened.facts.image_height);
  if (!assembly.render_noise_free(pose, picture.data())) return ok("it offers no noise-free image to compare with");
  if (!all_finite(picture)) return failed("the noise-free image has non-finite pixels");
  // Both images have a little noise, which can only increase the difference.
  const double difference = mean_square_difference(picture, packed(opened.scene.reference()));
  const double allowed = 6 * stated / std::sqrt(double{kSeeds}) + 0.25 * difference;
  if (std::fabs(mean - difference) > allowed)
    return failed("its mean ground truth is " + significant(mean) +
                  ", but its noise-free image differs from the reference image by " + significant(difference) +
                  " (mean square); the ground truth is biased");
  return ok();
}

Finding check_optimum(const Subject& subject) {
  Opened opened(subject.choice());
  if (opened.facts.owns_stage) return skipped(kStation);
  if (!opened.facts.truth) return skipped("it has no ground truth");
  MountedAssembly assembly = opened.scene.mount(opened.offsets());
  const auto found = trials::own_optimum(assembly, opened.facts, 1);
  if (!found) return skipped("it does not offer " RELIGN_SCENE_OPTIMUM " and does not ask for a search");
  const auto again = trials::own_optimum(assembly, opened.facts, 1);
  if (!again || again->true_pose != found->true_pose || again->mse != found->mse)
    return failed("the optimum for the same lens and seed changes when called again");
  const MountedAssembly::Truth there = assembly.noise_free_mse(found->true_pose, 2);
  const auto error = [](const MountedAssembly::Truth& a, const MountedAssembly::Truth& b) {
    return 6 * std::sqrt(a.standard_error * a.standard_error + b.standard_error * b.standard_error);
  };
  if (std::fabs(there.mse - found->mse) > error(there, {found->mse, found->standard_error}))
    return failed("the stated error at its optimum is " + significant(found->mse) + ", but its ground truth is " +
                  significant(there.mse));
  for (const std::vector<double>& other : {opened.facts.nominal_pose, opened.pose_near_nominal(0.03)}) {
    const MountedAssembly::Truth elsewhere = assembly.noise_free_mse(other, 3);
    if (elsewhere.mse + error(there, elsewhere) < there.mse)
      return failed("at a pose near the nominal one the error is " + significant(elsewhere.mse) +
                    ", less than at its optimum, " + significant(there.mse));
  }
  return ok();
}

Finding check_mtf(const Subject& subject) {
  constexpr double kCoarse = 1e-3, kFine = 1000;  // lp/mm
  Opened opened(subject.choice());
  if (opened.facts.owns_stage) return skipped(kStation);
  MountedAssembly assembly = opened.scene.mount(opened.offsets());
  const std::vector<double> pose = opened.pose_near_nominal(0.02);
  const auto coarse = assembly.mtf(pose, kCoarse);
  if (!coarse) return skipped("it does not offer " RELIGN_SCENE_MTF);
  const auto fine = assembly.mtf(pose, kFine);
  assembly.mtf(opened.facts.nominal_pose, kCoarse);
  const auto again = assembly.mtf(pose, kCoarse);
  Opened second(subject.choice(), 3);
  MountedAssembly twin = second.scene.mount(second.offsets());
  const auto elsewhere = twin.mtf(pose, kCoarse);
  for (const auto& other : {again, elsewhere})
    if (!other || other->centre != coarse->centre || other->corner != coarse->corner)
      return failed("the MTF for the same lens, pose and frequency changes when called again");
  if (!fine || fine->centre > coarse->centre || fine->corner > coarse->corner)
    return failed("the MTF at " + significant(kFine) + " lp/mm is higher than at " + significant(kCoarse) + " lp/mm");
  return ok();
}

Finding check_further_scores(const Subject& subject) {
  Opened opened(subject.choice());
  const std::vector<FurtherScore>& declared = opened.facts.score.further;
  if (declared.empty()) return skipped("its score declares none");
  MountedAssembly assembly = opened.scene.mount(opened.offsets());
  Opened second(subject.choice(), 3);
  MountedAssembly twin = second.scene.mount(second.offsets());
  const std::vector<double> pose = opened.pose_near_nominal(0.02);
  for (std::uint32_t i = 0; i < declared.size(); ++i) {
    at("with the further score " + in_quotes(declared[i].name));
    const auto value = assembly.further_score(pose, 1, i);
    if (!value) return failed("it does not offer " RELIGN_SCENE_FURTHER_SCORE ", which its declaration requires");
    if (*value < 0) return failed(in_quotes(declared[i].name) + " is " + significant(*value) + "; it is from 0");
    const double elsewhere = assembly.further_score(opened.facts.nominal_pose, 1, i).value_or(*value);
    for (const auto& other : {assembly.further_score(pose, 1, i), twin.further_score(pose, 1, i)})
      if (other != value)
        return failed(in_quotes(declared[i].name) + " changes for the same device, pose and seed when called again");
    if (elsewhere == *value)
      return warning(in_quotes(declared[i].name) + " is " + significant(*value) +
                     " at two poses; does it measure one?");
  }
  return ok();
}

Finding check_elements(const Subject& subject) {
  Opened opened(subject.choice());
  if (opened.facts.owns_stage) return skipped(kStation);
  try {
    opened.scene.mount(R"({"no such element": {"shift_mm": [0, 0, 0], "tilt_deg": [0, 0]}})");
  } catch (const Error&) {
    return ok();
  }
  return failed(
      "it accepts offsets of the unknown element 'no such element'; refuse unknown names, which may be misspelt");
}

namespace {

// Moves each axis both ways by more than the travel: the stage must stop, report its move, and report a limit. Returns
// a message if it does not.
std::string flaw_at_limits(Opened& opened) {
  constexpr double kAsked = 1.1;       // travels
  constexpr double kMaxTravel = 1.05;  // allows for encoder errors
  const std::size_t axes = opened.facts.axes.size();
  for (std::size_t axis = 0; axis < axes; ++axis)
    for (const double asked : {kAsked, -kAsked}) {
      const std::string where =
          "commanded to move axis " + std::to_string(axis) + " by " + shortest(asked) + " travels";
      at(where);
      std::vector<double> delta(axes, 0.0);
      delta[axis] = asked;
      const Scene::StageMove made = opened.scene.move_by(delta);
      if (std::fabs(made.moved[axis]) > kMaxTravel)
        return where + ", it reports a move of " + shortest(made.moved[axis]) +
               "; it must stop at the limit, and report the actual move (at most 1)";
      if (made.limits_low == 0 && made.limits_high == 0)
        return where + ", it reports a move of " + shortest(made.moved[axis]) + " but no limit";
    }
  return "";
}

}  // namespace

Finding check_stage(const Subject& subject) {
  Opened opened(subject.choice());
  if (!opened.facts.owns_stage) return skipped("the host moves its stage");
  if (!opened.scene.offers_stage())
    return failed("its description has 'owns_stage', but it does not offer " RELIGN_SCENE_STAGE);
  const std::size_t axes = opened.facts.axes.size();
  std::vector<float> pixels(std::size_t{opened.facts.image_width} * opened.facts.image_height);
  const auto capture_is_finite = [&] {
    std::fill(pixels.begin(), pixels.end(), std::nanf(""));
    opened.scene.capture(pixels.data());
    return all_finite(pixels);
  };
  constexpr const char* kBadPixels = "a capture has non-finite or missing pixels";
  // One seed twice: the start may differ, but the station must start again.
  for (const std::uint64_t seed : {std::uint64_t{1}, std::uint64_t{2}, std::uint64_t{1}}) {
    at("in the trial of seed " + std::to_string(seed));
    opened.scene.begin(seed);
    for (std::size_t move = 0; move <= axes; ++move) {
      if (move > 0) {
        std::vector<double> delta(axes, 0.0);
        delta[move - 1] = 0.01;
        opened.scene.move_by(delta);
      }
      if (!capture_is_finite()) return failed(kBadPixels);
    }
  }
  if (const std::string flaw = flaw_at_limits(opened); !flaw.empty()) return failed(flaw);
  if (!capture_is_finite()) return failed(std::string("at its limits ") + kBadPixels);
  opened.scene.begin(3);
  return capture_is_finite() ? ok() : failed(kBadPixels);
}

Finding check_travel(const Subject& subject) {
  Opened opened(subject.choice());
  if (opened.facts.owns_stage) return skipped(kStation);
  MountedAssembly assembly = opened.scene.mount("{}");
  const std::size_t axes = opened.facts.axes.size();
  const std::vector<std::pair<const char*, double>> places = {
      {"0", 0}, {"1", 1}, {"-0.5", -0.5}, {"1.5", 1.5}, {"-10", -10}, {"10", 10}, {"NaN", std::nan("")}};
  for (const auto& [name, value] : places) {
    at(std::string("with every axis at ") + name);
    try {
      const std::vector<float> pixels = opened.capture(assembly, std::vector<double>(axes, value), 5);
      if (value == value && !all_finite(pixels))
        return failed(std::string("with every axis at ") + name + " a capture has non-finite pixels");
      if (opened.facts.truth) assembly.noise_free_mse(std::vector<double>(axes, value), 6);
    } catch (const Error& error) {
      if (value >= 0 && value <= 1)
        return failed(std::string("with every axis at ") + name + ", inside the travel: " + error.what());
    }
  }
  return ok();
}

}  // namespace relign::conformance
