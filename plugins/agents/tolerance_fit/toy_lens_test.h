// A lens with a closed-form image and all services that tolerance-fit uses: three blobs whose position, width and
// balance depend on the pose. An element offset shifts the best pose and adds a feature that no move removes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <list>
#include <memory>
#include <nlohmann/json.hpp>
#include <relign/random.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "conformance/fake_trial.h"

namespace relign::test {

class ToyTrial {
 public:
  using Pose = conformance::Pose;
  static constexpr std::uint32_t kSide = 48;

  struct Setup {
    std::uint32_t axes = 5;
    unsigned budget = 8;
    double noise = 0.02;  // of a pixel; the blobs are 1 high
    double offset_std = 1;
    double largest_move = 0.2;
    std::uint64_t instance = 1;
    bool noise_free = true, slopes = true;  // what the model offers
    // Disturbances of captures. Stray light is in the reference image, too.
    float gain = 1, offset = 0, stray = 0;
  };

  explicit ToyTrial(const Setup& given) : setup_(given), offset_(drawn_offset(given.instance + kUnseen)) {
    const nlohmann::json drawn = draw(given.instance + kUnseen);
    start_ = drawn["start"].get<Pose>();
    distortion_ = drawn["distortion"].get<std::vector<Pose>>();
    scene_json_ =
        nlohmann::json{{"name", "toy"}, {"nominal_pose", Pose(given.axes, 0.5)}, {"elements", {"L1", "L2", "L3"}}}
            .dump();
    wanted_ = paint(Pose(given.axes, 0.5), 0);
    add_stray(wanted_);
    make_tables();
    conformance::FakeSetup fake;
    fake.axes = given.axes;
    fake.budget = given.budget;
    fake.observes = RELIGN_OBSERVES_IMAGES | RELIGN_OBSERVES_DESIGN | RELIGN_OBSERVES_LEVEL;
    fake.image_side = kSide;
    fake.largest_move = given.largest_move;
    fake.merit = [this](const Pose& commanded, std::uint32_t step) {
      shown_ = paint(true_pose(commanded), offset_);
      for (float& pixel : shown_) pixel = setup_.gain * pixel + setup_.offset;
      add_stray(shown_);
      add_noise(shown_, setup_.instance * 1000 + step + 1);
      return 0.0;
    };
    fake.paint = [this](double, float* pixels) { std::copy(shown_.begin(), shown_.end(), pixels); };
    fake.service = [this](std::string_view id) -> const void* {
      if (id == RELIGN_SERVICE_REFERENCE) return &reference_;
      if (id == RELIGN_SERVICE_PRIOR) return &prior_;
      if (id == RELIGN_SERVICE_MODEL) return &model_;
      return nullptr;
    };
    trial = std::make_unique<conformance::FakeTrial>(fake);
  }
  ToyTrial(const ToyTrial&) = delete;
  ToyTrial& operator=(const ToyTrial&) = delete;

  Pose true_pose(const Pose& commanded) const {
    Pose pose = start_;
    for (std::size_t row = 0; row < pose.size(); ++row) {
      for (std::size_t column = 0; column < pose.size(); ++column)
        pose[row] += distortion_[row][column] * commanded[column];
      pose[row] = std::clamp(pose[row], 0.0, 1.0);
    }
    return pose;
  }
  // Largest distance of a commanded pose from the lens's own best pose over the axes.
  double miss(const Pose& commanded) const {
    const Pose pose = true_pose(commanded);
    double worst = 0;
    for (std::size_t axis = 0; axis < pose.size(); ++axis)
      worst = std::max(worst, std::fabs(pose[axis] - best_pose(axis, offset_)));
    return worst;
  }
  double offset() const { return offset_; }
  // Distance of the lens's own best pose from the nominal one, on axis 0.
  double own_way() const { return std::fabs(best_pose(0, offset_) - 0.5); }

  std::unique_ptr<conformance::FakeTrial> trial;
  std::size_t most_mounted = 0;

 private:
  static constexpr std::uint64_t kUnseen = 1u << 20;  // numbers of draws that the agent does not request
  struct Lens {
    ToyTrial* toy;
    double offset;
  };

  static double best_pose(std::size_t axis, double offset) { return 0.5 + (axis % 2 ? -0.05 : 0.08) * offset; }

  double drawn_offset(std::uint64_t number) const { return setup_.offset_std * Random(number, 2).normal(); }

  nlohmann::json draw(std::uint64_t number) const {
    Random random(number, 1);
    nlohmann::json start = nlohmann::json::array(), rows = nlohmann::json::array();
    for (std::uint32_t row = 0; row < setup_.axes; ++row) start.push_back(random.uniform(0.2, 0.8));
    for (std::uint32_t row = 0; row < setup_.axes; ++row) {
      rows.push_back(nlohmann::json::array());
      for (std::uint32_t column = 0; column < setup_.axes; ++column)
        rows.back().push_back((row == column ? 1 : 0) + 0.01 * random.normal());
    }
    return {{"start", start},
            {"distortion", rows},
            {"elements", {{"L2", {{"tilt_deg", {drawn_offset(number), 0.0}}}}, {"L3", nlohmann::json::object()}}}};
  }

  static std::vector<float> paint(const Pose& pose, double offset) {
    double away[6] = {};
    for (std::size_t axis = 0; axis < pose.size() && axis < 6; ++axis)
      away[axis] = std::clamp(pose[axis], 0.0, 1.0) - best_pose(axis, offset);
    const double width = 4 * std::exp(away[2]), turn = away[3], balance = std::exp(2 * away[4]);
    std::vector<float> pixels(std::size_t{kSide} * kSide);
    for (int blob = 0; blob < 3; ++blob) {
      const double angle = 2.1 * blob + turn;
      const double x = kSide / 2.0 + 10 * std::cos(angle) + 24 * away[0],
                   y = kSide / 2.0 + 10 * std::sin(angle) + 24 * away[1];
      const double light = blob == 0 ? balance : 1;
      for (std::uint32_t row = 0; row < kSide; ++row)
        for (std::uint32_t column = 0; column < kSide; ++column) {
          const double r2 = std::pow(column - x, 2) + std::pow(row - y, 2);
          pixels[row * kSide + column] += static_cast<float>(light * std::exp(-0.5 * r2 / (width * width)));
        }
    }
    // A feature that no move removes, which makes the offset observable.
    for (std::uint32_t row = 0; row < 4; ++row)
      for (std::uint32_t column = 0; column < 4; ++column)
        pixels[row * kSide + column] += static_cast<float>(0.1 * offset);
    return pixels;
  }

  // The image and its derivatives, as the service has them. Only L2's tilt about x is not 0.
  static void differentiate(const Pose& pose, double offset, const std::vector<std::uint32_t>& elements,
                            float* pixels) {
    constexpr double kStride = 1e-3;
    const std::vector<float> middle = paint(pose, offset);
    pixels = std::copy(middle.begin(), middle.end(), pixels);
    const auto add = [&](const std::vector<float>& low, const std::vector<float>& high) {
      for (std::size_t i = 0; i < low.size(); ++i) *pixels++ = (high[i] - low[i]) / static_cast<float>(2 * kStride);
    };
    for (std::size_t axis = 0; axis < pose.size(); ++axis) {
      Pose low = pose, high = pose;
      low[axis] -= kStride, high[axis] += kStride;
      add(paint(low, offset), paint(high, offset));
    }
    for (const std::uint32_t element : elements)
      for (int number = 0; number < 5; ++number) {
        const double by = element == 1 && number == 3 ? kStride : 0;
        add(paint(pose, offset - by), paint(pose, offset + by));
      }
  }

  void add_noise(std::vector<float>& pixels, std::uint64_t seed) const {
    Random random(seed, 3);
    for (float& pixel : pixels) pixel += static_cast<float>(setup_.noise * random.normal());
  }

  void add_stray(std::vector<float>& pixels) const {
    for (std::uint32_t row = 0; row < kSide; ++row)
      for (std::uint32_t column = 0; column < kSide; ++column)
        pixels[row * kSide + column] +=
            setup_.stray *
            static_cast<float>(std::exp(-0.5 * (std::pow(column / 15.0 - 2, 2) + std::pow(row / 12.0 - 1, 2))));
  }

  static ToyTrial& of(void* context) { return *static_cast<ToyTrial*>(context); }

  void make_tables() {
    shown_ = wanted_;
    image_ = {sizeof image_, RELIGN_SAMPLE_FLOAT32, kSide, kSide, 1, 0, wanted_.data(), kSide * sizeof(float)};
    reference_ = {sizeof reference_, 0, nullptr, &image_};
    prior_.struct_size = sizeof prior_;
    prior_.context = this;
    prior_.draw = [](void* context, std::uint64_t number, const relign_text_sink* drawn) {
      const std::string text = of(context).draw(number).dump();
      drawn->write(drawn->context, {text.data(), text.size()});
      return relign_status{RELIGN_OK};
    };
    model_.struct_size = sizeof model_;
    model_.context = this;
    model_.scene_json = {scene_json_.data(), scene_json_.size()};
    model_.image_width = model_.image_height = kSide;
    model_.mount = [](void* context, relign_text offsets, relign_model_lens** made) {
      ToyTrial& toy = of(context);
      if (toy.lenses_.size() >= 16) return relign_status{RELIGN_BAD_ARGUMENT};
      const auto json = nlohmann::json::parse(std::string(offsets.data, offsets.size));
      const double offset = json.contains("L2") ? json["L2"]["tilt_deg"][0].get<double>() : 0.0;
      toy.lenses_.push_back({&toy, offset});
      toy.most_mounted = std::max(toy.most_mounted, toy.lenses_.size());
      *made = reinterpret_cast<relign_model_lens*>(&toy.lenses_.back());
      return relign_status{RELIGN_OK};
    };
    model_.capture = [](void*, relign_model_lens* lens, const double* pose, std::uint32_t axes, std::uint64_t seed,
                        float* pixels) { return of(lens).picture(lens, pose, axes, &seed, pixels); };
    model_.noise_free = [](void*, relign_model_lens* lens, const double* pose, std::uint32_t axes, float* pixels) {
      if (!of(lens).setup_.noise_free) return relign_status{RELIGN_UNSUPPORTED};
      return of(lens).picture(lens, pose, axes, nullptr, pixels);
    };
    model_.slopes = [](void*, relign_model_lens* lens, const double* pose, std::uint32_t axes, std::uint64_t,
                       std::uint32_t, const std::uint32_t* elements, std::uint32_t count, float* pixels) {
      if (!of(lens).setup_.slopes) return relign_status{RELIGN_UNSUPPORTED};
      differentiate(Pose(pose, pose + axes), reinterpret_cast<Lens*>(lens)->offset, {elements, elements + count},
                    pixels);
      return relign_status{RELIGN_OK};
    };
    model_.unmount = [](void* context, relign_model_lens* lens) {
      of(context).lenses_.remove_if([&](const Lens& known) { return static_cast<const void*>(&known) == lens; });
      return relign_status{RELIGN_OK};
    };
  }
  static ToyTrial& of(relign_model_lens* lens) { return *reinterpret_cast<Lens*>(lens)->toy; }

  relign_status picture(relign_model_lens* lens, const double* pose, std::uint32_t axes, const std::uint64_t* seed,
                        float* pixels) const {
    std::vector<float> painted = paint(Pose(pose, pose + axes), reinterpret_cast<Lens*>(lens)->offset);
    if (seed) add_noise(painted, *seed + (std::uint64_t{1} << 40));
    std::copy(painted.begin(), painted.end(), pixels);
    return RELIGN_OK;
  }

  Setup setup_;
  double offset_;
  Pose start_;
  std::vector<Pose> distortion_;
  std::string scene_json_;
  std::vector<float> wanted_, shown_;
  std::list<Lens> lenses_;
  relign_image image_{};
  relign_reference_service reference_{};
  relign_prior_service prior_{};
  relign_model_service model_{};
};

}  // namespace relign::test
