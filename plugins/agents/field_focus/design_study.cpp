#include "design_study.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "least_squares/poses.hpp"

namespace field_focus {
namespace {

using relign::Pose;

constexpr std::uint64_t kDesignSeed = 0xF0C5;  // noise of the design's images: the same in every trial
constexpr double kTiltStride = 0.1;            // share of the travel, for the differences of the design
constexpr double kLateralStride = 0.02;
constexpr double kNear = 0.5;      // of the spacing of marks: how far a mark may be from its place in the reference
constexpr double kCentred = 0.09;  // of a mark's side: for the best foci, both edges of marks near the border count
constexpr double kCurveStep = 0.1, kCurveReach = 2;  // strides: of the design's curves
constexpr double kCheckStep = 0.2;  // of a stride, of the captures that show what edges say of the design's focus
constexpr int kChecks = 4;          // such captures to either side
constexpr double kDark = 1e-3;      // MTF below which the design's curves are cut off
constexpr double kPi = 3.14159265358979323846;

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

// NaN unless all edges of a mark that are inside the image are measurable.
double mtf_at(const Mark& mark, const Mark& place, bool upright, double frequency, const Design& design,
              const Measure& measure) {
  const auto edges =
      edges_of(mark, place, upright, design.centred * place.side_px, 2 * design.half_width, 2 * design.half_height);
  double sum = 0;
  for (const auto& [x, y, width, height] : edges) {
    const nlohmann::json where = {
        {"cycles_per_pixel", frequency}, {"x", x}, {"y", y}, {"width", width}, {"height", height}};
    sum += measure("mtf", where.dump());
  }
  const double half_turn = kPi * frequency;
  return sum / static_cast<double>(edges.size()) * half_turn / std::sin(half_turn);
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

  // Adds the curves of the designed lens by rays, and how far edges are off them.
  void add_curves(Design& design, const std::string& scene_json, double frequency) const {
    design.centred = kCentred;
    const std::vector<std::pair<std::size_t, bool>> fields = fields_of(design, scene_json);
    std::vector<DesignCurve> level = curves_at(-1, 0, fields, frequency);
    double middle = 0;
    const auto share = 1 / static_cast<double>(level.size());
    for (const DesignCurve& curve : level) middle += share * curve.best();
    design.channel_slopes.assign(level.size(), Eigen::Vector2d::Zero());
    for (Eigen::Index tilt = 0; tilt < 2; ++tilt) {
      const std::vector<DesignCurve> ahead = curves_at(3 + tilt, kTiltStride, fields, frequency);
      const std::vector<DesignCurve> behind = curves_at(3 + tilt, -kTiltStride, fields, frequency);
      for (std::size_t i = 0; i < level.size(); ++i)
        design.channel_slopes[i][tilt] = (ahead[i].best() - behind[i].best()) / (2 * kTiltStride);
    }
    for (DesignCurve& curve : level) design.curves.push_back(curve.above(-middle));
    std::vector<Channel> channels = design.channels();
    const Measure measure = [this](const char* name, const std::string& where) { return lens_.measure(name, where); };
    for (int check = -kChecks; check <= kChecks; ++check) {
      const double z = middle + check * kCheckStep * stride_;
      const std::vector<float> pixels = image(-1, 0, z, static_cast<std::uint64_t>(kChecks + check));
      sample(channels, design, find_marks(pixels, width_, height_), Focus(z, 0, 0), 0, frequency, measure);
    }
    fit_by_design(channels, design.curves, Focus(middle, 0, 0), 0.5 * stride_);
    for (std::size_t i = 0; i < channels.size(); ++i)
      design.edges_above += share * (channels[i].curve->centre - middle - design.curves[i].best());
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
  // By mark, upright edges and level edges: the number of the field, and whether these are its tangential edges.
  std::vector<std::pair<std::size_t, bool>> fields_of(const Design& design, const std::string& scene_json) const {
    const nlohmann::json fields = nlohmann::json::parse(scene_json).value("fields", nlohmann::json::array());
    std::vector<std::pair<std::size_t, bool>> found;
    for (const Mark& mark : design.marks)
      for (std::size_t number = 0; number < fields.size(); ++number) {
        const nlohmann::json& field = fields[number];
        if (!field.contains("mark") || !field.contains("tangential")) continue;
        const double x = field["mark"]["x_px"], y = field["mark"]["y_px"];
        if (std::hypot(x - mark.x_px, y - mark.y_px) > 0.5 * mark.side_px) continue;
        const nlohmann::json& edge = field["tangential"];
        const bool upright = std::fabs(edge["x"].get<double>() + 0.5 * edge["width"].get<double>() - x) >
                             std::fabs(edge["y"].get<double>() + 0.5 * edge["height"].get<double>() - y);
        found.emplace_back(number, upright);
        found.emplace_back(number, !upright);
        break;
      }
    if (found.size() != 2 * design.marks.size())
      throw std::runtime_error("design_curves needs a scene that describes a field with both edges at each of the " +
                               std::to_string(design.marks.size()) + " marks of its chart");
    return found;
  }
  // log MTF through focus from rays, with this axis moved, in the order of `fields`.
  std::vector<DesignCurve> curves_at(Eigen::Index axis, double moved,
                                     const std::vector<std::pair<std::size_t, bool>>& fields, double frequency) const {
    const int reach = static_cast<int>(kCurveReach / kCurveStep);
    const double step = kCurveStep * stride_;
    const std::string what = nlohmann::json{{"cycles_per_pixel", frequency}}.dump();
    std::vector<std::vector<double>> tables(fields.size());
    for (int at = -reach; at <= reach; ++at) {
      const auto shown = lens_.fields(pose(axis, moved, at * step), what);
      if (!shown) throw std::runtime_error("design_curves needs a scene that measures the MTF of its fields from rays");
      for (std::size_t i = 0; i < tables.size(); ++i) {
        const relign::ModelField& field = shown->at(fields[i].first);
        tables[i].push_back(std::log(std::max(kDark, fields[i].second ? field.tangential : field.sagittal)));
      }
    }
    std::vector<DesignCurve> curves;
    for (auto& table : tables) curves.emplace_back(-reach * step, step, std::move(table));
    return curves;
  }
  Pose pose(Eigen::Index axis, double step, double defocus) const {
    Eigen::VectorXd pose = nominal_;
    if (axis >= 0) pose[axis] += step;
    pose[static_cast<Eigen::Index>(kFocusAxis)] += defocus;
    return least_squares::to_pose(pose.cwiseMax(0.0).cwiseMin(1.0));
  }
  std::vector<float> image(Eigen::Index axis, double step, double defocus, std::uint64_t number = 0) const {
    return lens_.capture(pose(axis, step, defocus), kDesignSeed + number);
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

}  // namespace

void sample(std::vector<Channel>& channels, const Design& design, const std::vector<Mark>& marks, const Focus& pose,
            double doubt, double frequency, const Measure& measure) {
  for (std::size_t i = 0; i < design.marks.size(); ++i) {
    const Mark& place = design.marks[i];
    const Mark* mark = nearest(marks, place.x_px, place.y_px, design.centred * place.side_px);
    for (std::size_t direction = 0; mark && direction < 2; ++direction) {
      const double mtf = mtf_at(*mark, place, direction == 0, frequency, design, measure);
      if (std::isfinite(mtf)) channels[2 * i + direction].samples.push_back({pose, mtf, doubt});
    }
  }
}

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

Design study_design(const relign::Model& model, const Eigen::VectorXd& nominal, double stride,
                    const std::vector<float>& reference, std::optional<double> curves) {
  const Study study(model, nominal, stride);
  Design design = study(reference);
  if (curves && !design.slopes.empty()) study.add_curves(design, model.scene_json(), *curves);
  return design;
}

}  // namespace field_focus
