// A trial without scene, stage or clock: the host's side of relign/plugin.h for a merit function that the caller
// chooses. For checks and tests of algorithms: fast, exact, and strict about the rules.
#pragma once

#include <relign/plugin.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <relign/random.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace relign::conformance {

using Pose = std::vector<double>;
class TrialScene;

// State of relign.prepared/1: what it reports, and the saved data.
struct FakePretraining {
  bool active = false;  // on a source instance
  std::uint32_t source = 0;
  std::uint32_t sources = 0;
  std::optional<std::string> bytes;
};

struct FakeSetup {
  std::uint32_t axes = 5;
  std::uint32_t budget = 50;
  std::uint32_t observes = RELIGN_OBSERVES_MERIT | RELIGN_OBSERVES_BOX;
  std::uint64_t seed = 1;
  Pose start;  // commanded; empty: zeros
  Pose lower;  // empty: -0.5
  Pose upper;  // empty: +0.5
  double largest_move = std::numeric_limits<double>::infinity();
  std::function<double(const Pose& commanded, std::uint32_t step)> merit;  // must be set
  std::function<void()> on_stop;                            // called for every answer RELIGN_STOP; may be empty
  std::string axes_json;                                    // empty: axes a0, a1, ... of 2 mm
  std::string readings_json = "[]";                         // shown with images only
  std::uint32_t image_side = 8;                             // pixels
  std::uint32_t image_height = 0;                           // 0: as image_side
  std::function<void(double merit, float* pixels)> paint;   // of a capture, after `merit`; empty: the merit everywhere
  std::vector<float> reference;                             // image; empty: as painted for the merit 0
  std::function<const void*(std::string_view id)> service;  // empty: none
  std::function<std::string()> why;                         // of the services' last failure; empty: no reason
  FakePretraining* pretraining = nullptr;                   // for relign.prepared/1; null: not offered
  TrialScene* scene = nullptr;                              // on which to pretrain; null: on synthetic sources
};

// A bowl with its minimum (merit 0.01) at `optimum`; axes differ in steepness, and neighbours are coupled.
inline double bowl(const Pose& pose, const Pose& optimum) {
  double sum = 0;
  for (std::size_t axis = 0; axis < pose.size(); ++axis) {
    double away = pose[axis] - optimum[axis];
    if (axis > 0) away += 0.3 * (pose[axis - 1] - optimum[axis - 1]);
    sum += (1.0 + 0.5 * static_cast<double>(axis)) * away * away;
  }
  return 0.01 + sum;
}

class FakeTrial {
 public:
  struct Visit {
    Pose pose;
    double merit;
  };
  struct Recommendation {
    std::size_t steps_made;  // before it
    Pose pose;
  };

  explicit FakeTrial(FakeSetup given) : setup(std::move(given)) {
    if (!setup.merit) throw std::logic_error("FakeSetup.merit must be set");
    if (setup.start.empty()) setup.start.assign(setup.axes, 0.0);
    if (setup.lower.empty()) setup.lower.assign(setup.axes, -0.5);
    if (setup.upper.empty()) setup.upper.assign(setup.axes, 0.5);
    if (setup.image_height == 0) setup.image_height = setup.image_side;
    axes_json_ = setup.axes_json;
    for (std::uint32_t axis = 0; setup.axes_json.empty() && axis < setup.axes; ++axis)
      axes_json_ +=
          std::string(axis ? "," : "[") + R"({"name":"a)" + std::to_string(axis) + R"(","unit":"mm","travel":2})";
    if (setup.axes_json.empty()) axes_json_ += "]";
    const bool box = setup.observes & RELIGN_OBSERVES_BOX;
    const bool images = setup.observes & RELIGN_OBSERVES_IMAGES;
    task_.struct_size = sizeof task_;
    task_.axes = setup.axes;
    task_.budget = setup.budget;
    task_.observes = setup.observes;
    task_.seed = setup.seed;
    task_.box_lower = box ? setup.lower.data() : nullptr;
    task_.box_upper = box ? setup.upper.data() : nullptr;
    task_.largest_move = setup.largest_move;
    task_.image_width = images ? setup.image_side : 0;
    task_.image_height = images ? setup.image_height : 0;
    task_.axes_json = {axes_json_.data(), axes_json_.size()};
    if (images) task_.readings_json = {setup.readings_json.data(), setup.readings_json.size()};
    trial_.struct_size = sizeof trial_;
    trial_.context = this;
    trial_.task = &task_;
    trial_.first = [](void* self, relign_observation* seen) { return of(self).first(seen); };
    trial_.step = [](void* self, const double* pose, std::uint32_t axes, relign_observation* seen) {
      return of(self).go(pose, axes, false, seen);
    };
    trial_.move = [](void* self, const double* delta, std::uint32_t axes, relign_observation* seen) {
      return of(self).go(delta, axes, true, seen);
    };
    trial_.recommend = [](void* self, const double* pose, std::uint32_t axes) {
      return of(self).recommend(pose, axes);
    };
    trial_.get_service = [](void* self, relign_text id) -> const void* {
      const FakeSetup& offered = of(self).setup;
      return offered.service && id.data ? offered.service({id.data, static_cast<std::size_t>(id.size)}) : nullptr;
    };
    trial_.why = [](void* self, const relign_text_sink* reason) -> relign_status {
      const std::string text = of(self).setup.why ? of(self).setup.why() : "";
      reason->write(reason->context, {text.data(), text.size()});
      return RELIGN_OK;
    };
  }
  FakeTrial(const FakeTrial&) = delete;
  FakeTrial& operator=(const FakeTrial&) = delete;

  const relign_trial& handle() const { return trial_; }

  FakeSetup setup;
  std::vector<Visit> steps;  // after step 0
  std::vector<Recommendation> recommendations;
  unsigned requests_after_stop = 0;  // steps requested after the answer RELIGN_STOP
  bool stopped = false;              // a request was answered with RELIGN_STOP
  bool refused = false;              // a request was answered with RELIGN_BAD_ARGUMENT

  // The last observation of the algorithm, and its image, even if the algorithm does not observe images.
  const relign_observation& last() const { return last_; }
  const relign_image& last_image() const { return *shown_image_; }

  Pose best_pose() const {
    Pose best = setup.start;
    double merit = setup.merit(setup.start, 0);
    for (const Visit& visit : steps)
      if (visit.merit < merit) {
        merit = visit.merit;
        best = visit.pose;
      }
    return best;
  }

 private:
  static FakeTrial& of(void* context) { return *static_cast<FakeTrial*>(context); }

  relign_status first(relign_observation* seen) {
    if (!steps.empty()) {
      refused = true;
      return RELIGN_BAD_ARGUMENT;
    }
    show(setup.start, setup.merit(setup.start, 0), seen);
    return RELIGN_OK;
  }

  relign_status go(const double* values, std::uint32_t axes, bool relative, relign_observation* seen) {
    if (stopped) ++requests_after_stop;
    bool sound = axes == setup.axes && values;
    for (std::uint32_t axis = 0; sound && axis < axes; ++axis) sound = std::isfinite(values[axis]);
    if (!sound) {
      refused = true;
      return RELIGN_BAD_ARGUMENT;
    }
    if (steps.size() >= setup.budget) {
      stopped = true;
      if (setup.on_stop) setup.on_stop();
      return RELIGN_STOP;
    }
    const Pose& from = steps.empty() ? setup.start : steps.back().pose;
    Pose pose(values, values + axes);
    for (std::uint32_t axis = 0; axis < axes; ++axis) {
      const double move = relative ? pose[axis] : pose[axis] - from[axis];
      if (relative || std::fabs(move) > setup.largest_move)
        pose[axis] = from[axis] + std::max(-setup.largest_move, std::min(setup.largest_move, move));
    }
    const double merit = setup.merit(pose, static_cast<std::uint32_t>(steps.size() + 1));
    steps.push_back({pose, merit});
    show(pose, merit, seen);
    return RELIGN_OK;
  }

  relign_status recommend(const double* pose, std::uint32_t axes) {
    bool sound = axes == setup.axes && pose;
    for (std::uint32_t axis = 0; sound && axis < axes; ++axis) sound = std::isfinite(pose[axis]);
    if (!sound) {
      refused = true;
      return RELIGN_BAD_ARGUMENT;
    }
    recommendations.push_back({steps.size(), Pose(pose, pose + axes)});
    return RELIGN_OK;
  }

  // Allocates memory for every observation and frees it at the next one, so that sanitizers find algorithms that keep a
  // view too long.
  void show(const Pose& pose, double merit, relign_observation* seen) {
    const std::uint32_t width = setup.image_side, height = setup.image_height;
    shown_pose_ = std::make_unique<Pose>(pose);
    shown_pixels_ = std::make_unique<std::vector<float>>(std::size_t{width} * height, static_cast<float>(merit));
    if (setup.paint) setup.paint(merit, shown_pixels_->data());
    shown_image_ =
        std::make_unique<relign_image>(relign_image{sizeof(relign_image), RELIGN_SAMPLE_FLOAT32, width, height, 1, 0,
                                                    shown_pixels_->data(), width * sizeof(float)});
    last_ = {};
    last_.struct_size = sizeof last_;
    last_.step = static_cast<std::uint32_t>(steps.size());
    last_.pose = shown_pose_->data();
    last_.merit = setup.observes & RELIGN_OBSERVES_MERIT ? merit : std::numeric_limits<double>::quiet_NaN();
    last_.image = setup.observes & RELIGN_OBSERVES_IMAGES ? shown_image_.get() : nullptr;
    last_.machine_seconds = 0.1 * static_cast<double>(steps.size());
    const std::uint32_t room = std::min<std::uint32_t>(seen->struct_size, sizeof last_);
    std::memcpy(seen, &last_, room);
    seen->struct_size = room;
  }

  std::string axes_json_;
  relign_task task_{};
  relign_trial trial_{};
  relign_observation last_{};
  std::unique_ptr<Pose> shown_pose_;
  std::unique_ptr<std::vector<float>> shown_pixels_;
  std::unique_ptr<relign_image> shown_image_;
};

}  // namespace relign::conformance
