// through-focus: centre the image, sweep the focus, level the plane of best focus, verify. See README.md.
#include "centring.hpp"
#include "levelling.hpp"

namespace {

using relign::Pose;
using through_focus::Capture;
using through_focus::Metrics;
using through_focus::metrics_of;

// The axis order of all scenes: two lateral axes, focus, two tilts, rotation. A stage with fewer axes lacks the later
// ones, except that a single axis is the focus. Further axes are not moved.
constexpr std::size_t kAcross = 2, kFirstTilt = 3, kMaxTilts = 2, kTurn = 5;
constexpr int kLongestSearch = 40;  // images; the trial ends if the target is not found
constexpr int kLongestSweep = 12;   // images; the trial ends if no focus is found
constexpr double kTolerance = 1.3;  // ratio of smoothed mean squares explained by noise

class ThroughFocus final : public relign::Optimizer {
 public:
  explicit ThroughFocus(const relign::Parameters& given)
      : probe_(given.number("probe")),
        defocus_(given.number("defocus")),
        tilt_probe_(given.number("tilt_probe")),
        rounds_(given.integer("rounds")) {}

  void run(relign::Trial& trial) override {
    trial_ = &trial;
    box_ = trial.box();
    centring_.emplace(trial.axes(), probe_);
    focus_axis_ = trial.axes() > 1 ? kAcross : 0;
    const relign::Observation first = trial.first();
    take(first);
    if (box_.clamp(first.pose) != first.pose && !go(first.pose)) return;  // moves into the box
    if (find_target() && learn_centring() && turn_upright() && sweep() && probe_tilts()) level();
  }

 private:
  std::size_t tilts() const {
    const std::size_t axes = trial_->axes();
    return axes > kFirstTilt ? std::min(axes - kFirstTilt, kMaxTilts) : 0;
  }

  void take(const relign::Observation& observation) {
    const relign::Measures measures = trial_->measures();
    const relign::ImageView image = observation.image();
    Capture capture{observation.pose, metrics_of(image, trial_->reference(), measures.measure("shift_x_px"),
                                                 measures.measure("shift_y_px"))};
    if (trial_->axes() > kTurn) capture.metrics.rotation = measures.measure("rotation_deg");
    at_limit_ = (observation.limits_low | observation.limits_high) != 0;
    if (now_ && !at_limit_) centring_->learn(*now_, capture);
    now_ = std::move(capture);
    const double difference = now_->metrics.difference;
    if (std::isfinite(difference) && difference < best_difference_ && box_.clamp(now_->pose) == now_->pose) {
      best_difference_ = difference;
      best_ = now_->pose;
      if (!solved_) trial_->recommend(best_);
    }
  }

  // One move and one capture; false when the trial is over.
  bool go(const Pose& pose) {
    const auto observation = trial_->step(box_.clamp(pose));
    if (observation) take(*observation);
    return observation.has_value();
  }

  // `pose` changed so that the image is centred and upright, as far as the response is known.
  Pose centred(Pose pose) const {
    if (turn_response_ != 0 && std::isfinite(now_->metrics.rotation))
      pose[kTurn] = now_->pose[kTurn] - now_->metrics.rotation / turn_response_;
    return box_.clamp(centring_->centred({*now_}, pose).value_or(pose));
  }
  Pose centred_at(Pose pose) const {
    for (std::size_t axis = 0; axis < std::min(kAcross, focus_axis_); ++axis) pose[axis] = now_->pose[axis];
    return centred(std::move(pose));
  }

  // The same based on several captures, which reduces the noise.
  Pose centred_by(const std::vector<Capture>& captures, const Pose& pose) const {
    const Pose near = centred_at(pose);
    return box_.clamp(centring_->centred(captures, near).value_or(near));
  }

  // A move towards the side of the box with more room.
  double inward(std::size_t axis, double length) const {
    return now_->pose[axis] > 0.5 * (box_.lower[axis] + box_.upper[axis]) ? -length : length;
  }

  // Searches until the target is visible: first the middle of the box, then Halton points.
  bool find_target() {
    constexpr unsigned kPrimes[] = {2, 3, 5, 7, 11, 13};
    for (unsigned image = 1; !now_->metrics.sound; ++image) {
      if (image > kLongestSearch) return false;
      Pose pose = now_->pose;
      for (std::size_t axis = 0; axis < std::min(pose.size(), std::size(kPrimes)); ++axis) {
        double place = 0, digit = 1;
        for (unsigned rest = image; rest > 0; rest /= kPrimes[axis])
          place += (digit /= kPrimes[axis]) * (rest % kPrimes[axis]);
        pose[axis] = box_.lower[axis] + (image == 1 ? 0.5 : place) * (box_.upper[axis] - box_.lower[axis]);
      }
      if (!go(pose)) return false;
    }
    return true;
  }

  bool learn_centring() {
    if (focus_axis_ == 0) return true;
    for (std::size_t axis = 0; axis < kAcross; ++axis) {
      Pose pose = now_->pose;
      pose[axis] += inward(axis, probe_);
      if (!go(pose)) return false;
    }
    if (!go(centred(now_->pose))) return false;
    // If limits prevent centring, the tilts are far off: move them to the middle of the box, the best guess.
    if (tilts() > 0 && now_->metrics.placed && lateral_at_limit()) {
      Pose pose = now_->pose;
      for (std::size_t axis = 0; axis < kFirstTilt + tilts(); ++axis)
        if (axis != focus_axis_) pose[axis] = 0.5 * (box_.lower[axis] + box_.upper[axis]);
      if (!go(pose)) return false;
    }
    if (!go(centred(now_->pose))) return false;
    return tilts() == 0 || !now_->metrics.placed || !lateral_at_limit() || centre_with_tilts();
  }

  // If the middle of the box is no better (without a known start it is the start), tilts and shifts may both be far
  // off: centre the image with all of them, by the smallest move.
  bool centre_with_tilts() {
    std::vector<std::size_t> axes = {0, 1};
    Pose middle = now_->pose;
    for (std::size_t axis = 0; axis < kAcross; ++axis) middle[axis] = 0.5 * (box_.lower[axis] + box_.upper[axis]);
    for (std::size_t tilt = kFirstTilt; tilt < kFirstTilt + tilts(); ++tilt) {
      Pose pose = middle;
      pose[tilt] += inward(tilt, tilt_probe_);
      if (!go(middle) || !go(pose)) return false;
      axes.push_back(tilt);
    }
    for (int image = 0; image < 2; ++image)
      if (!go(box_.clamp(centring_->centred({*now_}, middle, axes).value_or(middle)))) return false;
    return go(centred(now_->pose));
  }

  bool lateral_at_limit() const {
    if (at_limit_) return true;
    for (std::size_t axis = 0; axis < kAcross; ++axis)
      if (now_->pose[axis] <= box_.lower[axis] || now_->pose[axis] >= box_.upper[axis]) return true;
    return false;
  }

  // Measures the effect of the rotation axis by a small move; from then on centred() keeps the image upright.
  bool turn_upright() {
    if (trial_->axes() <= kTurn || !std::isfinite(now_->metrics.rotation)) return true;
    const Capture before = *now_;
    Pose pose = now_->pose;
    pose[kTurn] += inward(kTurn, tilt_probe_);
    if (!go(centred(pose))) return false;
    const double move = now_->pose[kTurn] - before.pose[kTurn];
    const double turned = now_->metrics.rotation - before.metrics.rotation;
    // Below a tenth of a degree noise dominates.
    if (!(std::fabs(turned) > 0.1) || !(std::fabs(move) > 1e-9)) return true;
    turn_response_ = turned / move;
    return go(centred(now_->pose));
  }

  // Steps through focus in equal strides until the sharpest image is between two others. Returns false without a focus.
  bool sweep() {
    if (trial_->axes() <= focus_axis_ || !now_->metrics.sound) return false;
    std::vector<Capture> captures = {*now_};  // in order of z
    bool upwards = inward(focus_axis_, defocus_) > 0;
    for (int image = 0; image < kLongestSweep; ++image) {
      std::size_t sharpest = 0;
      for (std::size_t i = 1; i < captures.size(); ++i)
        if (captures[i].metrics.sharpness > captures[sharpest].metrics.sharpness) sharpest = i;
      if (captures.size() > 1) {
        if (sharpest > 0 && sharpest + 1 < captures.size()) {
          focus_ = captures[sharpest].pose[focus_axis_];
          const std::vector<Capture> near(captures.begin() + static_cast<std::ptrdiff_t>(sharpest) - 1,
                                          captures.begin() + static_cast<std::ptrdiff_t>(sharpest) + 2);
          focus_ = through_focus::lowest(near, focus_axis_, focus_).value_or(focus_);
          return true;
        }
        upwards = sharpest > 0;
      }
      const double from = upwards ? captures.back().pose[focus_axis_] : captures.front().pose[focus_axis_];
      const double limit = upwards ? box_.upper[focus_axis_] : box_.lower[focus_axis_];
      if (from == limit) {  // sharpest at the limit
        focus_ = limit;
        return true;
      }
      Pose pose = now_->pose;
      pose[focus_axis_] = from + (upwards ? defocus_ : -defocus_);
      if (!go(centred(pose)) || !now_->metrics.sound) return false;
      captures.insert(upwards ? captures.end() : captures.begin(), *now_);
    }
    return false;
  }

  // One capture on each side of the focus, with the tilts of `tilted`.
  bool capture_both_sides(const Pose& tilted, std::vector<Capture>* captures) {
    Metrics sides[2];
    double z[2];
    for (int side = 0; side < 2; ++side) {
      // Start on the side of the current pose, for less travel.
      const bool above = (side == 0) == (now_->pose[focus_axis_] > focus_);
      Pose pose = tilted;
      pose[focus_axis_] = focus_ + (above ? defocus_ : -defocus_);
      if (!go(centred_at(pose)) || !now_->metrics.sound) return false;
      sides[above ? 1 : 0] = now_->metrics;
      z[above ? 1 : 0] = now_->pose[focus_axis_];
      captures->push_back(*now_);
    }
    if (!(z[1] - z[0] > 1e-9)) return false;
    evenness_.push_back(through_focus::evenness_between(sides[0], sides[1], z[1] - z[0]));
    for (std::size_t tilt = 0; tilt < tilts(); ++tilt) evenness_.back().tilt[tilt] = now_->pose[kFirstTilt + tilt];
    return true;
  }

  bool probe_tilts() {
    if (tilts() == 0) return true;
    Pose middle = now_->pose;
    middle[focus_axis_] = focus_;
    std::vector<Capture> unused;
    if (!capture_both_sides(middle, &unused)) return false;
    for (std::size_t tilt = 0; tilt < tilts(); ++tilt) {
      Pose pose = middle;
      pose[kFirstTilt + tilt] += inward(kFirstTilt + tilt, tilt_probe_);
      if (!capture_both_sides(pose, &unused)) return false;
    }
    return true;
  }

  // Repeats: compute the level tilts from all measurements, then capture both sides of the focus there.
  void level() {
    std::vector<Capture> captures;
    Pose solution = now_->pose;
    for (std::size_t tilt = 0; tilt < tilts(); ++tilt)
      solution[kFirstTilt + tilt] = evenness_.front().tilt[tilt];  // before the probes
    for (std::int64_t round = 0; round <= rounds_; ++round) {
      const auto level = through_focus::level_tilts(evenness_, tilts(), 3 * tilt_probe_);
      for (std::size_t tilt = 0; tilt < tilts(); ++tilt)
        solution[kFirstTilt + tilt] = level[tilt].value_or(solution[kFirstTilt + tilt]);
      // Captures at other tilts have another focus.
      captures.erase(std::remove_if(captures.begin(), captures.end(),
                                    [&](const Capture& capture) {
                                      return tilt_between(capture.pose, solution) > 0.5 * tilt_probe_;
                                    }),
                     captures.end());
      focus_ = through_focus::lowest(captures, focus_axis_, focus_).value_or(focus_);
      solution[focus_axis_] = focus_;
      solution = box_.clamp(solution);
      focus_ = solution[focus_axis_];
      // Recommended poses are verified by a capture in focus: at the first solution, after a change of tilts, and at
      // the end.
      if (captures.empty() || round == rounds_) {
        if (!verify(solution, &captures)) return;
      } else if (solved_) {
        trial_->recommend(centred_by(captures, solution));
      }
      if (round < rounds_ && !capture_both_sides(solution, &captures)) return;
    }
  }

  double tilt_between(const Pose& one, const Pose& other) const {
    double largest = 0;
    for (std::size_t tilt = kFirstTilt; tilt < kFirstTilt + tilts(); ++tilt)
      largest = std::max(largest, std::fabs(one[tilt] - other[tilt]));
    return largest;
  }

  // Captures at `pose` and recommends it if it is not significantly worse than the best capture; otherwise that one.
  bool verify(const Pose& pose, std::vector<Capture>* captures) {
    if (!go(captures->empty() ? centred_at(pose) : centred_by(*captures, pose))) return false;
    if (!now_->metrics.sound) return false;
    captures->push_back(*now_);
    solved_ = now_->metrics.difference <= best_difference_ * kTolerance;
    trial_->recommend(solved_ ? centred_by(*captures, now_->pose) : best_);
    return true;
  }

  double probe_, defocus_, tilt_probe_;  // share of the travel
  std::int64_t rounds_;
  relign::Trial* trial_ = nullptr;
  relign::Box box_;
  std::size_t focus_axis_ = kAcross;
  std::optional<Capture> now_;
  Pose best_;
  double best_difference_ = std::numeric_limits<double>::infinity();
  bool solved_ = false;
  bool at_limit_ = false;  // the last move hit a limit of the stage
  std::optional<through_focus::Centring> centring_;
  double turn_response_ = 0;  // degrees per share of the travel; 0: unknown
  double focus_ = 0;
  std::vector<through_focus::Evenness> evenness_;
};

}  // namespace

RELIGN_PLUGIN(ThroughFocus)
