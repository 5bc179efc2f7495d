// Centre, sweep the focus, level the plane of best focus, verify: the way of production lines. See README.md.
#include "centring.hpp"
#include "levelling.hpp"

namespace {

using relign::Pose;
using through_focus::Look;
using through_focus::look_at;
using through_focus::Seen;

// Axes by the order that all scenes keep: across, across, focus, two tilts, turn. A shorter stage lacks the later ones,
// but one that has a single axis focuses. What comes after the turn stays where it is.
constexpr std::size_t kAcross = 2, kFirstTilt = 3, kMostTilts = 2, kTurn = 5;
constexpr int kLongestSearch = 40;  // images; a search that finds no target ends the trial
constexpr int kLongestSweep = 12;   // images; a sweep that finds no focus ends the trial
constexpr double kTolerance = 1.3;  // smoothed mean squares differ by less than that through the captures' noise

class ThroughFocus final : public relign::Optimizer {
 public:
  explicit ThroughFocus(const relign::Parameters& given)
      : probe_(given.number("probe")),
        defocus_(given.number("defocus")),
        tilt_probe_(given.number("tilt_probe")),
        rounds_(given.integer("rounds")) {}

  void run(relign::Conversation& talk) override {
    talk_ = &talk;
    box_ = talk.box();
    centring_.emplace(talk.axes(), probe_);
    focus_axis_ = talk.axes() > 1 ? kAcross : 0;
    const relign::Observation first = talk.first();
    take(first);
    if (box_.clamp(first.pose) != first.pose && !go(first.pose)) return;  // enters the box
    if (find_target() && learn_centring() && turn_upright() && sweep() && probe_tilts()) level();
  }

 private:
  std::size_t tilts() const {
    const std::size_t axes = talk_->axes();
    return axes > kFirstTilt ? std::min(axes - kFirstTilt, kMostTilts) : 0;
  }

  void take(const relign::Observation& observation) {
    const relign::Measures measures = talk_->measures();
    const relign::ImageView image = observation.image();
    Seen seen{observation.pose,
              look_at(image, talk_->reference(), measures.measure("shift_x_px"), measures.measure("shift_y_px"))};
    if (talk_->axes() > kTurn) seen.look.rotation = measures.measure("rotation_deg");
    held_ = (observation.limits_low | observation.limits_high) != 0;
    if (now_ && !held_) centring_->learn(*now_, seen);
    now_ = std::move(seen);
    const double difference = now_->look.difference;
    if (std::isfinite(difference) && difference < best_difference_ && box_.clamp(now_->pose) == now_->pose) {
      best_difference_ = difference;
      best_ = now_->pose;
      if (!solved_) talk_->recommend(best_);
    }
  }

  // One move and one capture; false once there are no more.
  bool go(const Pose& pose) {
    const auto seen = talk_->step(box_.clamp(pose));
    if (seen) take(*seen);
    return seen.has_value();
  }

  // `pose` with the image in the middle and upright, as far as is known.
  Pose centred(Pose pose) const {
    if (turn_response_ != 0 && std::isfinite(now_->look.rotation))
      pose[kTurn] = now_->pose[kTurn] - now_->look.rotation / turn_response_;
    return box_.clamp(centring_->centred({*now_}, pose).value_or(pose));
  }
  Pose centred_at(Pose pose) const {
    for (std::size_t axis = 0; axis < std::min(kAcross, focus_axis_); ++axis) pose[axis] = now_->pose[axis];
    return centred(std::move(pose));
  }

  // The same by all of these captures: one alone misses the middle by its noise.
  Pose centred_by(const std::vector<Seen>& captures, const Pose& pose) const {
    const Pose near = centred_at(pose);
    return box_.clamp(centring_->centred(captures, near).value_or(near));
  }

  // Towards the side of the box that has more room.
  double inward(std::size_t axis, double length) const {
    return now_->pose[axis] > 0.5 * (box_.lower[axis] + box_.upper[axis]) ? -length : length;
  }

  // Until the target is seen somewhere: the middle of the box first, then evenly all over it (Halton's points).
  bool find_target() {
    constexpr unsigned kPrimes[] = {2, 3, 5, 7, 11, 13};
    for (unsigned image = 1; !now_->look.sound; ++image) {
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
    // The stage's walls hold the image back: the tilts are far off. They go to the middle of the box, the best guess.
    if (tilts() > 0 && now_->look.placed && at_wall()) {
      Pose pose = now_->pose;
      for (std::size_t axis = 0; axis < kFirstTilt + tilts(); ++axis)
        if (axis != focus_axis_) pose[axis] = 0.5 * (box_.lower[axis] + box_.upper[axis]);
      if (!go(pose)) return false;
    }
    if (!go(centred(now_->pose))) return false;
    return tilts() == 0 || !now_->look.placed || !at_wall() || share_centring();
  }

  // The middle of the box was no better (where the start is unknown, it is the start): tilts and shifts alike may be
  // far off, so they share the way to the image's middle.
  bool share_centring() {
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

  bool at_wall() const {
    if (held_) return true;
    for (std::size_t axis = 0; axis < kAcross; ++axis)
      if (now_->pose[axis] <= box_.lower[axis] || now_->pose[axis] >= box_.upper[axis]) return true;
    return false;
  }

  // A small turn tells how the image follows; from then on `centred` keeps it upright.
  bool turn_upright() {
    if (talk_->axes() <= kTurn || !std::isfinite(now_->look.rotation)) return true;
    const Seen before = *now_;
    Pose pose = now_->pose;
    pose[kTurn] += inward(kTurn, tilt_probe_);
    if (!go(centred(pose))) return false;
    const double move = now_->pose[kTurn] - before.pose[kTurn];
    const double turned = now_->look.rotation - before.look.rotation;
    // Less than a tenth of a degree says more of the noise than of the axis.
    if (!(std::fabs(turned) > 0.1) || !(std::fabs(move) > 1e-9)) return true;
    turn_response_ = turned / move;
    return go(centred(now_->pose));
  }

  // Through focus in equal strides, on until the sharpest image lies between two others; false without a focus.
  bool sweep() {
    if (talk_->axes() <= focus_axis_ || !now_->look.sound) return false;
    std::vector<Seen> captures = {*now_};  // in order of z
    bool upwards = inward(focus_axis_, defocus_) > 0;
    for (int image = 0; image < kLongestSweep; ++image) {
      std::size_t sharpest = 0;
      for (std::size_t i = 1; i < captures.size(); ++i)
        if (captures[i].look.sharpness > captures[sharpest].look.sharpness) sharpest = i;
      if (captures.size() > 1) {
        if (sharpest > 0 && sharpest + 1 < captures.size()) {
          focus_ = captures[sharpest].pose[focus_axis_];
          const std::vector<Seen> near(captures.begin() + static_cast<std::ptrdiff_t>(sharpest) - 1,
                                       captures.begin() + static_cast<std::ptrdiff_t>(sharpest) + 2);
          focus_ = through_focus::lowest(near, focus_axis_, focus_).value_or(focus_);
          return true;
        }
        upwards = sharpest > 0;
      }
      const double from = upwards ? captures.back().pose[focus_axis_] : captures.front().pose[focus_axis_];
      const double wall = upwards ? box_.upper[focus_axis_] : box_.lower[focus_axis_];
      if (from == wall) {  // sharpest at the wall: that is the focus
        focus_ = wall;
        return true;
      }
      Pose pose = now_->pose;
      pose[focus_axis_] = from + (upwards ? defocus_ : -defocus_);
      if (!go(centred(pose)) || !now_->look.sound) return false;
      captures.insert(upwards ? captures.end() : captures.begin(), *now_);
    }
    return false;
  }

  // At `pose`'s tilts, one capture on each side of the focus.
  bool look_around(const Pose& tilted, std::vector<Seen>* captures) {
    Look sides[2];
    double z[2];
    for (int side = 0; side < 2; ++side) {
      // Begins on the side where the stage is: less travel.
      const bool above = (side == 0) == (now_->pose[focus_axis_] > focus_);
      Pose pose = tilted;
      pose[focus_axis_] = focus_ + (above ? defocus_ : -defocus_);
      if (!go(centred_at(pose)) || !now_->look.sound) return false;
      sides[above ? 1 : 0] = now_->look;
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
    std::vector<Seen> unused;
    if (!look_around(middle, &unused)) return false;
    for (std::size_t tilt = 0; tilt < tilts(); ++tilt) {
      Pose pose = middle;
      pose[kFirstTilt + tilt] += inward(kFirstTilt + tilt, tilt_probe_);
      if (!look_around(pose, &unused)) return false;
    }
    return true;
  }

  // Level, look on both sides of the focus, level again with all that is known.
  void level() {
    std::vector<Seen> captures;
    Pose solution = now_->pose;
    for (std::size_t tilt = 0; tilt < tilts(); ++tilt)
      solution[kFirstTilt + tilt] = evenness_.front().tilt[tilt];  // before the probes
    for (std::int64_t round = 0; round <= rounds_; ++round) {
      const auto level = through_focus::level_tilts(evenness_, tilts(), 3 * tilt_probe_);
      for (std::size_t tilt = 0; tilt < tilts(); ++tilt)
        solution[kFirstTilt + tilt] = level[tilt].value_or(solution[kFirstTilt + tilt]);
      // Captures at other tilts are blurred otherwise: they say nothing of the focus here.
      captures.erase(
          std::remove_if(captures.begin(), captures.end(),
                         [&](const Seen& seen) { return tilt_between(seen.pose, solution) > 0.5 * tilt_probe_; }),
          captures.end());
      focus_ = through_focus::lowest(captures, focus_axis_, focus_).value_or(focus_);
      solution[focus_axis_] = focus_;
      solution = box_.clamp(solution);
      focus_ = solution[focus_axis_];
      // What is recommended has been looked at in focus: at the first solution, where it moves and at the end.
      if (captures.empty() || round == rounds_) {
        if (!verify(solution, &captures)) return;
      } else if (solved_) {
        talk_->recommend(centred_by(captures, solution));
      }
      if (round < rounds_ && !look_around(solution, &captures)) return;
    }
  }

  double tilt_between(const Pose& one, const Pose& other) const {
    double largest = 0;
    for (std::size_t tilt = kFirstTilt; tilt < kFirstTilt + tilts(); ++tilt)
      largest = std::max(largest, std::fabs(one[tilt] - other[tilt]));
    return largest;
  }

  // Recommended when it is no worse than the best capture of all, but for noise; else that one stays.
  bool verify(const Pose& pose, std::vector<Seen>* captures) {
    if (!go(captures->empty() ? centred_at(pose) : centred_by(*captures, pose))) return false;
    if (!now_->look.sound) return false;
    captures->push_back(*now_);
    solved_ = now_->look.difference <= best_difference_ * kTolerance;
    talk_->recommend(solved_ ? centred_by(*captures, now_->pose) : best_);
    return true;
  }

  double probe_, defocus_, tilt_probe_;  // share of the travel
  std::int64_t rounds_;
  relign::Conversation* talk_ = nullptr;
  relign::Box box_;
  std::size_t focus_axis_ = kAcross;
  std::optional<Seen> now_;
  Pose best_;
  double best_difference_ = std::numeric_limits<double>::infinity();
  bool solved_ = false;
  bool held_ = false;  // by a limit of the stage, at the last move
  std::optional<through_focus::Centring> centring_;
  double turn_response_ = 0;  // degrees per share of the travel; 0: unknown
  double focus_ = 0;
  std::vector<through_focus::Evenness> evenness_;
};

}  // namespace

RELIGN_PLUGIN(ThroughFocus)
