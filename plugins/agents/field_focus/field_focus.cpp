// field-focus: centre by the marks, sweep the focus, level the plane of best focus, verify. See README.md.
#include <cmath>
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>
#include <stdexcept>
#include <string>

#include "focus_curves.hpp"
#include "least_squares/learnt_once.hpp"
#include "least_squares/nominal_pose.hpp"
#include "marks.hpp"

namespace {

using field_focus::Channel;
using field_focus::find_marks;
using field_focus::Focus;
using field_focus::Mark;
using field_focus::Part;
using field_focus::part_of;
using relign::Pose;

// The axis order of all scenes: two lateral axes, focus, two tilts, rotation.
constexpr std::size_t kFocusAxis = 2, kFirstTilt = 3, kTurn = 5;
constexpr std::uint64_t kDesignSeed = 0xF0C5;  // noise of the design's images: the same in every trial
constexpr double kTiltStride = 0.1;            // share of the travel, for the differences of the design
constexpr double kLateralStride = 0.02;
constexpr double kNear = 0.5;      // of the spacing of marks: how far a mark may be from its place in the reference
constexpr double kCentred = 0.12;  // of a mark's side: shift up to which its edges are inside the window
constexpr double kPlay = 0.05;     // of log MTF, where z came down: a few micrometres of play
constexpr std::size_t kMaxDesigns = 4;
constexpr double kPi = 3.14159265358979323846;

using Shift = Eigen::Vector3d;  // of the image: columns, rows, rotation in radians

// What the design says about a chart: how marks move and how the focus of a field changes with the pose.
struct Design {
  std::vector<Mark> marks;                 // as the reference shows them
  double half_width = 0, half_height = 0;  // of the image, pixels
  double limit = 0;                        // how far a mark may be from its place, pixels
  Eigen::MatrixXd motion;                  // Shift x axes, per share of the travel
  std::vector<Eigen::Vector2d> slopes;     // by mark: share of the focus axis per share of the tilts; none: no chart
};

std::vector<float> pixels_of(const relign::ImageView& image) {
  std::vector<float> pixels;
  for (std::size_t y = 0; y < image.height(); ++y)
    pixels.insert(pixels.end(), image.row(y), image.row(y) + image.width());
  return pixels;
}

// Mean shift and rotation against the reference, from the marks that both images show. Nothing with fewer than two.
std::optional<Shift> shift_of(const Design& design, const std::vector<Mark>& marks) {
  std::vector<Eigen::Vector4d> pairs;  // place in the reference, shift
  for (const Mark& mark : design.marks)
    if (const Mark* found = nearest(marks, mark.x_px, mark.y_px, design.limit))
      pairs.emplace_back(mark.x_px, mark.y_px, found->x_px - mark.x_px, found->y_px - mark.y_px);
  if (pairs.size() < 2) return std::nullopt;
  Eigen::Vector4d mean = Eigen::Vector4d::Zero();
  for (const auto& pair : pairs) mean += pair / static_cast<double>(pairs.size());
  double moment = 0, inertia = 0;
  for (const auto& pair : pairs) {
    const Eigen::Vector4d from = pair - mean;
    moment += from[0] * from[3] - from[1] * from[2];
    inertia += from[0] * from[0] + from[1] * from[1];
  }
  return Shift(mean[2], mean[3], moment / inertia);
}

// Squared gradient near a mark over the squared level; products of neighbours, so that noise averages out.
double edge_energy(const std::vector<float>& pixels, std::size_t width, std::size_t height, const Mark& mark) {
  const auto from = [](double place, double half) { return static_cast<std::size_t>(std::max(2.0, place - half)); };
  const double half = 0.75 * mark.side_px;
  double energy = 0, level = 0;
  std::size_t count = 0;
  for (std::size_t y = from(mark.y_px, half); y + 2 < height && static_cast<double>(y) < mark.y_px + half; ++y)
    for (std::size_t x = from(mark.x_px, half); x + 2 < width && static_cast<double>(x) < mark.x_px + half; ++x) {
      const float* at = pixels.data() + y * width + x;
      const double across = (at[1] - at[-1]) * (at[width + 1] - at[width - 1]);
      const double down = (at[width] - *(at - width)) * (at[width + 1] - *(at - width + 1));
      energy += across + down;
      level += *at;
      ++count;
    }
  return level > 0 ? energy * static_cast<double>(count) / (level * level) : 0;
}

class Study {
 public:
  Study(const relign::Model& model, Eigen::VectorXd nominal, double stride)
      : lens_(model.mount("{}")),
        width_(model.width()),
        height_(model.height()),
        nominal_(std::move(nominal)),
        stride_(stride) {}

  Design operator()(const std::vector<float>& reference) const {
    Design design;
    design.half_width = 0.5 * static_cast<double>(width_), design.half_height = 0.5 * static_cast<double>(height_);
    design.marks = find_marks(reference, width_, height_);
    keep_fields(design.marks);
    if (design.marks.size() < 3) return design;
    double spacing = static_cast<double>(width_);
    for (const Mark& one : design.marks)
      for (const Mark& other : design.marks)
        if (&one != &other) spacing = std::min(spacing, std::hypot(one.x_px - other.x_px, one.y_px - other.y_px));
    design.limit = kNear * spacing;
    const Eigen::Index axes = nominal_.size();
    design.motion = Eigen::MatrixXd::Zero(3, axes);
    for (Eigen::Index axis = 0; axis < axes; ++axis) {
      const double step = axis < 3 ? kLateralStride : kTiltStride;
      const auto ahead = shift_at(design, axis, step), behind = shift_at(design, axis, -step);
      if (ahead && behind) design.motion.col(axis) = (*ahead - *behind) / (2 * step);
    }
    const std::vector<double> level = foci(design, -1);
    std::vector<std::vector<double>> tilted;
    for (Eigen::Index tilt = 0; tilt < 2; ++tilt) tilted.push_back(foci(design, 3 + tilt));
    // The slopes are smooth over the image: a linear function of the mark's place averages their errors.
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(design.marks.size()), 3);
    Eigen::MatrixXd slopes(rows.rows(), 2);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const auto mark = static_cast<std::size_t>(i);
      rows.row(i) << 1, design.marks[mark].x_px / static_cast<double>(width_),
          design.marks[mark].y_px / static_cast<double>(width_);
      for (Eigen::Index tilt = 0; tilt < 2; ++tilt)
        slopes(i, tilt) = (tilted[static_cast<std::size_t>(tilt)][mark] - level[mark]) / kTiltStride;
    }
    const Eigen::MatrixXd smooth = rows * rows.colPivHouseholderQr().solve(slopes);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) design.slopes.emplace_back(smooth.row(i));
    return design;
  }

 private:
  // The centre, and marks near 0.8 and 0.45 of the way to sides and corners, as fields are defined in docs/services.md.
  void keep_fields(std::vector<Mark>& marks) const {
    std::vector<Mark> kept;
    const double x = 0.5 * static_cast<double>(width_), y = 0.5 * static_cast<double>(height_);
    const auto keep = [&](double u, double v) {
      const Mark* mark = nearest(marks, x + u * x, y + v * y, x);
      if (mark && !nearest(kept, mark->x_px, mark->y_px, 1)) kept.push_back(*mark);
    };
    for (const double v : {-0.8, 0.0, 0.8})
      for (const double u : {-0.8, 0.0, 0.8}) keep(u, v);
    for (const double v : {-0.45, 0.45})
      for (const double u : {-0.45, 0.45}) keep(u, v);
    marks = std::move(kept);
  }
  std::vector<float> image(Eigen::Index axis, double step, double defocus) const {
    Eigen::VectorXd pose = nominal_;
    if (axis >= 0) pose[axis] += step;
    pose[static_cast<Eigen::Index>(kFocusAxis)] += defocus;
    return lens_.capture(least_squares::to_pose(pose.cwiseMax(0.0).cwiseMin(1.0)), kDesignSeed);
  }
  std::optional<Shift> shift_at(const Design& design, Eigen::Index axis, double step) const {
    return shift_of(design, find_marks(image(axis, step, 0), width_, height_));
  }
  // Best z of every mark, with this axis moved: vertex of a parabola through the logarithms of five edge energies,
  // weighted by their squares.
  std::vector<double> foci(const Design& design, Eigen::Index axis) const {
    std::vector<Channel> channels(design.marks.size());
    for (Channel& channel : channels) channel.slope.setZero();
    for (int k = -2; k <= 2; ++k) {
      const double z = 0.5 * k * stride_;
      const std::vector<float> pixels = image(axis, kTiltStride, z);
      for (std::size_t i = 0; i < channels.size(); ++i)
        channels[i].samples.push_back({Focus(z, 0, 0), edge_energy(pixels, width_, height_, design.marks[i])});
    }
    std::vector<double> foci;
    for (Channel& channel : channels) {
      double highest = 0;
      for (const auto& sample : channel.samples) highest = std::max(highest, sample.mtf);
      for (auto& sample : channel.samples) sample.mtf /= highest;
    }
    fit(channels, stride_);
    for (const Channel& channel : channels) foci.push_back(channel.curve ? channel.curve->centre : 0);
    return foci;
  }

  relign::ModelLens lens_;
  std::size_t width_, height_;
  Eigen::VectorXd nominal_;
  double stride_;
};

class FieldFocus final : public relign::Agent {
 public:
  explicit FieldFocus(const relign::Parameters& given)
      : frequency_(given.number("cycles_per_pixel")),
        stride_(given.number("stride")),
        sweep_(static_cast<int>(given.integer("sweep"))),
        worst_(given.boolean("worst_field")),
        centre_limit_(given.number("centre_limit")),
        corner_limit_(given.number("corner_limit")),
        other_limit_(given.number("other_limit")),
        other_scenes_(given.boolean("other_scenes")) {}

  void run(relign::Trial& trial) override {
    trial_ = &trial;
    if (trial.axes() >= kTurn) design_ = study();
    if (!design_ || design_->slopes.empty()) {
      if (!other_scenes_) throw std::runtime_error(what_is_missing());
      const relign::Observation start = trial.first();
      trial.step(start.pose);
      return;
    }
    for (auto& channels : channels_)
      for (std::size_t i = 0; i < design_->slopes.size(); ++i)
        channels.insert(channels.end(), 2, Channel{design_->slopes[i], {}, limit_of(design_->marks[i])});
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
    origin.add(model.scene_json()).add(reference).add(stride_);
    static least_squares::LearntOnce<Design> designs(kMaxDesigns);
    return designs(origin, [&] { return Study(model, nominal, stride_)(reference); });
  }

  void take(const relign::Observation& observation) {
    pose_ = observation.pose;
    const relign::ImageView image = observation.image();
    const std::vector<Mark> marks = find_marks(pixels_of(image), image.width(), image.height());
    if (const auto shift = shift_of(*design_, marks)) shift_ = *shift, shift_pose_ = pose_;
    const Focus focus(pose_[kFocusAxis], pose_[kFirstTilt], pose_[kFirstTilt + 1]);
    for (std::size_t i = 0; i < design_->marks.size(); ++i) {
      const Mark& place = design_->marks[i];
      const Mark* mark = nearest(marks, place.x_px, place.y_px, kCentred * place.side_px);
      for (std::size_t direction = 0; mark && direction < 2; ++direction)
        for (std::size_t k = 0; k < 2; ++k) {
          const double mtf = mtf_at(*mark, place, direction == 0, frequency_ / (k == 0 ? 2 : 1), image);
          if (std::isfinite(mtf))
            channels_[k][2 * i + direction].samples.push_back({focus, mtf, descended_ ? kPlay : 0});
        }
    }
  }

  // At the middle of a mark, without the pixels' part, as criteria by field measure it. NaN unless all its edges that
  // are inside the image are measurable.
  double mtf_at(const Mark& mark, const Mark& place, bool upright, double frequency,
                const relign::ImageView& image) const {
    const auto edges = edges_of(mark, place, upright, kCentred * place.side_px, static_cast<double>(image.width()),
                                static_cast<double>(image.height()));
    double sum = 0;
    for (const auto& [x, y, width, height] : edges) {
      const nlohmann::json where = {
          {"cycles_per_pixel", frequency}, {"x", x}, {"y", y}, {"width", width}, {"height", height}};
      sum += trial_->measures().measure("mtf", where.dump());
    }
    const double half_turn = kPi * frequency;
    return sum / static_cast<double>(edges.size()) * half_turn / std::sin(half_turn);
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
    for (const double k : {-0.25, -0.083, 0.083, 0.25}) {
      const double below = k == -0.25 ? kApproach : 0;
      if (!go(centred(middle + Focus(k * stride_, -below, -below)))) return false;
      update();
    }
    return true;
  }

  // The best pose by the samples so far, if they suffice.
  void update() {
    const double reach = 0.5 * stride_;
    std::vector<Channel>& channels = channels_[1];
    if (!worst_) {
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
  bool worst_;
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
