// field-focus: centre by the marks, sweep the focus, level the plane of best focus, verify. See README.md.
#include <array>
#include <cmath>
#include <relign/plugin.hpp>
#include <stdexcept>
#include <string>

#include "design_study.hpp"
#include "least_squares/learnt_once.hpp"
#include "least_squares/nominal_pose.hpp"

namespace {

using field_focus::Channel;
using field_focus::Design;
using field_focus::find_marks;
using field_focus::fit_by_design;
using field_focus::Focus;
using field_focus::kFirstTilt;
using field_focus::kFocusAxis;
using field_focus::kTurn;
using field_focus::Mark;
using field_focus::Part;
using field_focus::part_of;
using field_focus::Shift;
using relign::Pose;

constexpr double kPlay = 0.05;  // of log MTF, where z came down: a few micrometres of play
constexpr std::size_t kMaxDesigns = 4;

std::vector<float> pixels_of(const relign::ImageView& image) {
  std::vector<float> pixels;
  for (std::size_t y = 0; y < image.height(); ++y)
    pixels.insert(pixels.end(), image.row(y), image.row(y) + image.width());
  return pixels;
}

class FieldFocus final : public relign::Agent {
 public:
  explicit FieldFocus(const relign::Parameters& given)
      : frequency_(given.number("cycles_per_pixel")),
        stride_(given.number("stride")),
        sweep_(static_cast<int>(given.integer("sweep"))),
        worst_(given.boolean("worst_field")),
        curves_(given.boolean("design_curves")),
        centre_limit_(given.number("centre_limit")),
        corner_limit_(given.number("corner_limit")),
        other_limit_(given.number("other_limit")),
        other_scenes_(given.boolean("other_scenes")) {
    if (curves_ && worst_)
      throw std::invalid_argument("design_curves is for the plane of best focus: worst_field must be false");
  }

  void run(relign::Trial& trial) override {
    trial_ = &trial;
    if (trial.axes() >= kTurn) design_ = study();
    if (!design_ || design_->slopes.empty()) {
      if (!other_scenes_) throw std::runtime_error(what_is_missing());
      const relign::Observation start = trial.first();
      trial.step(start.pose);
      return;
    }
    for (auto& channels : channels_) {
      channels = design_->channels();
      for (std::size_t i = 0; i < channels.size(); ++i) channels[i].limit = limit_of(design_->marks[i / 2]);
    }
    take(trial.first());
    if (coarse() && fine()) approach();
  }

 private:
  std::string what_is_missing() const {
    const std::string found = design_ ? "3 dark squares on white near the fields of a chart, found " +
                                            std::to_string(design_->marks.size()) + " in its reference image"
                                      : "5 axes or more, found " + std::to_string(trial_->axes());
    return "the scene needs " + found + "; use one with the target camera_chart, such as camera_2mp";
  }

  std::optional<double> limit_of(const Mark& mark) const {
    const Part part = part_of(mark, design_->half_width, design_->half_height);
    const double limit = part == Part::centre ? centre_limit_ : part == Part::corner ? corner_limit_ : other_limit_;
    return limit < 0 ? std::nullopt : std::optional(limit);
  }

  std::shared_ptr<const Design> study() const {
    const relign::Model model = trial_->model();
    const std::vector<float> reference = pixels_of(trial_->reference());
    const Eigen::VectorXd nominal = least_squares::nominal_pose(model.scene_json(), trial_->axes());
    least_squares::Origin origin;
    origin.add(model.scene_json()).add(reference).add(stride_).add(curves_ ? frequency_ : 0.0);
    static least_squares::LearntOnce<Design> designs(kMaxDesigns);
    return designs(origin, [&] {
      return field_focus::study_design(model, nominal, stride_, reference,
                                       curves_ ? std::optional(frequency_) : std::nullopt);
    });
  }

  void take(const relign::Observation& observation) {
    pose_ = observation.pose;
    const relign::ImageView image = observation.image();
    const std::vector<Mark> marks = find_marks(pixels_of(image), image.width(), image.height());
    if (const auto shift = shift_of(*design_, marks)) shift_ = *shift, shift_pose_ = pose_;
    if (shift_pose_.empty()) shift_pose_ = pose_;  // too few marks in the first capture: as if it were centred
    const Focus focus(pose_[kFocusAxis], pose_[kFirstTilt], pose_[kFirstTilt + 1]);
    const field_focus::Measure measure = [this](const char* name, const std::string& where) {
      return trial_->measures().measure(name, where);
    };
    for (const std::size_t k : {0, 1})
      sample(channels_[k], *design_, marks, focus, descended_ ? kPlay : 0, frequency_ / (k == 0 ? 2 : 1), measure);
  }

  // The pose with this focus and tilts at which the image is centred and upright.
  Pose centred(const Focus& focus) const {
    Pose pose = shift_pose_;
    pose[kFocusAxis] = focus[0], pose[kFirstTilt] = focus[1], pose[kFirstTilt + 1] = focus[2];
    Shift left = shift_;
    for (std::size_t axis = kFocusAxis; axis < kTurn; ++axis)
      left += design_->motion.col(static_cast<Eigen::Index>(axis)) * (pose[axis] - shift_pose_[axis]);
    if (pose.size() > kTurn) {
      Eigen::Matrix3d response;
      response << design_->motion.leftCols(2), design_->motion.col(kTurn);
      const Eigen::Vector3d move = response.fullPivLu().solve(-left);
      pose[0] += move[0], pose[1] += move[1], pose[kTurn] += move[2];
    } else {
      const Eigen::Vector2d move = design_->motion.topLeftCorner(2, 2).fullPivLu().solve(-left.head<2>());
      pose[0] += move[0], pose[1] += move[1];
    }
    return pose;
  }

  bool go(const Pose& pose) {
    descended_ = pose[kFocusAxis] < pose_[kFocusAxis];
    const auto observation = trial_->step(pose);
    if (observation) take(*observation);
    return observation.has_value();
  }

  // The plane through the best foci by these samples; nothing before there are curves.
  std::optional<Focus> plane(std::vector<Channel>& channels, double reach) const {
    if (fit(channels, reach) < 3) return std::nullopt;
    return plane_of_best_focus(channels);
  }

  // Sweeps upwards; extends the sweep while more than a third of the channels are sharpest at its end.
  bool coarse() {
    const Focus start(pose_[kFocusAxis], pose_[kFirstTilt], pose_[kFirstTilt + 1]);
    const int longest = 2 * sweep_ + 1;
    int low = -(sweep_ / 2), high = low - 1;
    while (high - low + 1 < longest) {
      const bool upwards = high - low + 1 < sweep_ || sharpest_at(start[0] + high * stride_);
      if (!upwards && !sharpest_at(start[0] + low * stride_)) break;
      const int k = upwards ? ++high : --low;
      if (!go(centred(start + Focus(k * stride_, 0, 0)))) return false;
    }
    const auto solution = plane(channels_[0], stride_);
    if (!solution) return false;
    solution_ = *solution;
    trial_->recommend(centred(solution_));
    return true;
  }

  bool sharpest_at(double z) const {
    std::size_t there = 0, all = 0;
    for (const Channel& channel : channels_[0]) {
      const field_focus::Sample* highest = nullptr;
      for (const auto& sample : channel.samples)
        if (!highest || sample.mtf > highest->mtf) highest = &sample;
      if (!highest) continue;
      ++all;
      if (std::fabs(highest->pose[0] - z) < 0.25 * stride_) ++there;
    }
    return 3 * there > all;
  }

  // Captures on both sides of the solution, upwards: near it, because errors of curves grow with the distance. The
  // tilts come from below with the second.
  bool fine() {
    update();
    const Focus middle = solution_;
    // The flanks of a known curve say most about its place.
    const std::array<double, 4> near = {-0.25, -0.083, 0.083, 0.25}, flanks = {-0.5, -0.25, 0.25, 0.5};
    const std::array<double, 4>& places = curves_ ? flanks : near;
    for (const double k : places) {
      const double below = k == places.front() ? kApproach : 0;
      if (!go(centred(middle + Focus(k * stride_, -below, -below)))) return false;
      update();
    }
    return true;
  }

  // The best pose by the samples so far, if they suffice.
  void update() {
    const double reach = 0.5 * stride_;
    std::vector<Channel>& channels = channels_[1];
    if (curves_) {
      fit_by_design(channels, design_->curves, solution_, reach);
      solution_ = plane_of_best_focus(channels) - Focus(design_->edges_above, 0, 0);
    } else if (!worst_) {
      if (const auto best = plane(channels, reach)) solution_ = *best;
    } else if (fit_near(channels, solution_, reach) >= 3) {
      solution_ = best_of_worst(channels, solution_, reach);
    }
    trial_->recommend(centred(solution_));
  }

  // Every axis approaches its goal from below in small moves, so that the play of the stage is taken up.
  void approach() {
    for (double below = 3;; below = std::max(1.0, below - 1)) {
      Pose pose = centred(solution_);
      for (double& axis : pose) axis -= kApproach * below;
      if (!go(pose)) return;
      update();
    }
  }

  static constexpr double kApproach = 0.004;  // share of the travel

  double frequency_;  // cycles per pixel
  double stride_;
  int sweep_;
  bool worst_, curves_;
  double centre_limit_, corner_limit_, other_limit_;  // below 0: not specified
  bool other_scenes_;
  relign::Trial* trial_ = nullptr;
  std::shared_ptr<const Design> design_;
  // At half the frequency for the first sweep, then at the frequency; by mark: upright edges, level edges.
  std::vector<Channel> channels_[2];
  Pose pose_, shift_pose_;
  bool descended_ = false;  // the last move lowered z
  Shift shift_ = Shift::Zero();
  Focus solution_ = Focus::Zero();
};

}  // namespace

RELIGN_PLUGIN(FieldFocus)
