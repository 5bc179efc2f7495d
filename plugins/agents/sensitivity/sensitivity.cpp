// Alignment by the sensitivities of the design, as in computer-aided alignment of telescopes. See README.md.
#include <relign/plugin.hpp>

#include "design.hpp"
#include "least_squares/learnt_once.hpp"
#include "least_squares/nominal_pose.hpp"
#include "memory.hpp"
#include "registration.hpp"

namespace {

using least_squares::to_pose;
using least_squares::to_vector;
using sensitivity::Belief;
using sensitivity::Design;
using sensitivity::Estimate;
using sensitivity::Memory;
using sensitivity::Picture;
using sensitivity::Registration;
using sensitivity::Vector;

constexpr std::size_t kMaxSide = 256;          // larger images are binned
constexpr double kLost = 1.12;                 // misfit above which a registration from scratch is tried
constexpr int kMaxFirst = 12, kMaxLater = 5;   // comparisons per capture, first and later ones
constexpr std::uint64_t kDesignSeed = 0x5E45;  // noise of the design's images: the same in every trial
constexpr std::size_t kMaxDesigns = 4;         // cached for later trials
constexpr int kCapturesForClean = 64;          // averaged if a scene has no noise-free images

// An image of the model.
struct ModelPixels {
  const std::vector<float>& pixels;
  std::size_t width;
  float at(std::size_t x, std::size_t y) const { return pixels[y * width + x]; }
};

// The lens as designed, from the service `model`.
class ModelledLens {
 public:
  ModelledLens(const relign::Model& model, const least_squares::Binning& binning)
      : lens_(model.mount("{}")), binning_(binning), width_(model.width()) {}

  Picture capture(const Vector& pose, std::uint64_t seed) const {
    return binning_(ModelPixels{lens_.capture(inside(pose), seed), width_});
  }
  sensitivity::Rendering mean_capture(const Vector& pose, relign::Random& random, int captures) const {
    Picture sum = Picture::Zero(binning_.pixels());
    double squares = 0;
    for (int k = 0; k < captures; ++k) {
      const Picture one = capture(pose, random.bits64());
      squares += static_cast<double>(one.squaredNorm());
      sum += one;
    }
    const Picture mean = sum / static_cast<float>(captures);
    const double spread = squares - static_cast<double>(mean.squaredNorm()) * captures;
    return {mean, spread / static_cast<double>(std::max(captures - 1, 1) * std::max<Eigen::Index>(mean.size(), 1))};
  }
  Picture clean(const Vector& pose) const {
    if (const auto pixels = lens_.noise_free(inside(pose))) return binning_(ModelPixels{*pixels, width_});
    relign::Random random(kDesignSeed);
    return mean_capture(pose, random, kCapturesForClean).mean;
  }

 private:
  static relign::Pose inside(const Vector& pose) { return to_pose(pose.cwiseMax(0.0).cwiseMin(1.0)); }

  relign::ModelLens lens_;
  least_squares::Binning binning_;
  std::size_t width_;
};

// The goal, limited to one move from `here`.
Vector within_a_move(const Vector& here, const Vector& goal, double largest) {
  return here + (goal - here).cwiseMax(-largest).cwiseMin(largest);
}

class Sensitivity final : public relign::Agent {
 public:
  explicit Sensitivity(const relign::Parameters& given)
      : relinearise_(given.boolean("relinearise")),
        first_blur_(given.number("first_blur")),
        captures_(static_cast<int>(given.integer("model_captures"))),
        use_reference_(given.boolean("use_reference")),
        stray_light_(given.boolean("stray_light")),
        stop_below_(given.number("stop_below")),
        trusted_(given.number("trusted_distance")) {}

  void run(relign::Trial& trial) override {
    relign::Observation observation = trial.first();
    const relign::Model model = trial.model();
    const relign::ImageView reference = trial.reference();
    if (model.width() != reference.width() || model.height() != reference.height())
      throw std::runtime_error("the model's images have " + std::to_string(model.width()) + " x " +
                               std::to_string(model.height()) + " pixels, the reference image has " +
                               std::to_string(reference.width()) + " x " + std::to_string(reference.height()) +
                               "; must be equal");
    const least_squares::Binning binning(reference.width(), reference.height(), kMaxSide);
    const ModelledLens lens(model, binning);
    const auto design = study(model.scene_json(), binning, binning(reference), lens, trial.axes());

    relign::Random random(trial.seed());
    // Scenes with images large enough to be binned are slow, and binning reduces their noise.
    const int captures = std::max(2, captures_ / static_cast<int>(binning.bin()));
    Registration registration{*design, {}, captures, use_reference_};
    if (relinearise_)
      registration.render = [&](Vector& away, int count) {
        const Vector pose = (design->nominal + away).cwiseMax(0.0).cwiseMin(1.0);
        away = pose - design->nominal;
        return lens.mean_capture(pose, random, count);
      };

    Memory::Errors errors;
    errors.foreign = design->noise / (trusted_ * trusted_) * design->levels.back().inverse;
    Memory memory(to_vector(observation.pose), errors);
    for (bool first = true;; first = false) {
      const Vector here = to_vector(observation.pose);
      update(registration, binning(observation.image()), here, first, memory);
      const Vector next = within_a_move(here, memory.best().mean(), trial.largest_move());
      trial.recommend(to_pose(next));
      if (stop_below_ > 0 &&
          sensitivity::expected_excess(*design, memory.best_after_move(here, next), next) < stop_below_)
        return;
      auto moved = trial.step(to_pose(next));
      if (!moved) return;
      observation = std::move(*moved);
    }
  }

 private:
  // Adds the estimate of a capture to the memory; resets the memory if a registration from scratch fits better.
  void update(const Registration& registration, const Picture& capture, const Vector& here, bool first,
              Memory& memory) const {
    const Belief& best = memory.best();
    const Belief away{best.information, best.information * (here - best.mean())};
    Estimate estimate = registration(capture, away, first ? kMaxFirst : kMaxLater);
    if (!first && relinearise_ && estimate.misfit > kLost) {
      const Belief anything = Belief::around(Vector::Zero(here.size()), Memory::Errors().spread);
      const Estimate anew = registration(capture, anything, kMaxFirst);
      if (anew.misfit < estimate.misfit - (stray_light_ ? sensitivity::kWorse : 0)) {
        estimate = anew;
        memory.reset(here);
      }
    }
    memory.add(here, estimate.away);
  }

  std::shared_ptr<const Design> study(const std::string& scene_json, const least_squares::Binning& binning,
                                      const Picture& reference, const ModelledLens& lens, std::size_t axes) const {
    const Vector nominal = least_squares::nominal_pose(scene_json, axes);
    least_squares::Origin origin;
    origin.add(scene_json)
        .add(first_blur_)
        .add(stray_light_ ? 1.0 : 0.0)
        .add(reference)
        .add(lens.capture(nominal, kDesignSeed));
    const sensitivity::Simulator simulator{
        [&](const Vector& pose) { return lens.clean(pose); },
        [&](const Vector& pose, std::uint64_t k) { return lens.capture(pose, kDesignSeed + k); }};
    static least_squares::LearntOnce<Design> designs(kMaxDesigns);
    return designs(origin, [&] {
      return sensitivity::study(simulator, nominal, reference, binning.width(), binning.height(), first_blur_,
                                stray_light_);
    });
  }

  bool relinearise_;
  double first_blur_;   // share of the image's side
  int captures_;        // of the model, per image at the finest level
  bool use_reference_;  // instead of images of the model near its nominal pose
  bool stray_light_;    // fit disturbances
  double stop_below_;   // RMSE
  double trusted_;      // share of the travel
};

}  // namespace

RELIGN_PLUGIN(Sensitivity)
