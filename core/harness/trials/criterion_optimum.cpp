#include "trials/criterion_optimum.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <nlopt.hpp>
#include <optional>
#include <utility>

namespace relign::trials {
namespace {

constexpr double kPerSquaredPixel = 1e-4;
constexpr double kPerTravel = 1e5;  // poses are rounded to this part of it
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Point = std::vector<double>;  // along the observable axes

// What the search minimises, as a function of the observable axes.
class Objective {
 public:
  Objective(const std::function<FieldValues(const std::vector<double>&)>& measure, const SceneFacts& scene,
            const Criteria& criteria, const FieldValues& design, const std::vector<double>& start)
      : measure_(measure), criteria_(criteria), design_(design), pose_(start), axes_(scene.observable_axes()) {
    for_each_limit(criteria_, [this](double least, auto, auto) { limits_.push_back(least); });
    for (std::size_t i = 0; i < axes_.size(); ++i)
      if (scene.axes[axes_[i]].name == "z") z_ = i;
  }

  std::size_t axes() const { return axes_.size(); }
  std::optional<std::size_t> z() const { return z_; }  // among the observable axes
  const std::vector<double>& limits() const { return limits_; }

  Point point_of(const std::vector<double>& pose) const {
    Point point;
    for (const std::size_t axis : axes_) point.push_back(pose[axis]);
    return point;
  }
  const std::vector<double>& posed(const Point& point) {
    for (std::size_t i = 0; i < axes_.size(); ++i) pose_[axes_[i]] = std::clamp(point[i], 0.0, 1.0);
    return pose_;
  }

  const FieldValues& fields_at(const Point& point) {
    const std::vector<double>& pose = posed(point);
    auto found = known_.find(pose);
    if (found == known_.end()) found = known_.emplace(pose, measure_(pose)).first;
    return found->second;
  }
  // Places of the fields with a limit in the image, in pixels; NaN without light.
  std::vector<std::pair<double, double>> places(const Point& point) {
    const FieldValues& fields = fields_at(point);
    std::vector<std::pair<double, double>> found;
    for_each_limit(criteria_,
                   [&](double, auto field, auto) { found.emplace_back(fields[field].x_px, fields[field].y_px); });
    return found;
  }
  // Logarithms of the limited MTFs, then the shift in pixels: nearly quadratic functions of the pose. A shift that is
  // unknown counts as 100 pixels.
  Eigen::VectorXd at(const Point& point) {
    constexpr double kDarkest = 1e-4, kUnknownShift_px = 100;
    const FieldValues& fields = fields_at(point);
    Eigen::VectorXd values(static_cast<Eigen::Index>(limits_.size()) + 2);
    Eigen::Index next = 0;
    for_each_limit(criteria_, [&](double, auto field, auto mtf) {
      values[next++] = std::log(std::max(fields[field].*mtf, kDarkest));
    });
    const FieldShift shift = shift_of(fields, design_);
    values[next] = std::isnan(shift.x_px) ? kUnknownShift_px : shift.x_px;
    values[next + 1] = std::isnan(shift.y_px) ? 0 : shift.y_px;
    return values;
  }
  double largest_deficit(const Eigen::VectorXd& values) const {
    double largest = -kInfinity;
    for (std::size_t i = 0; i < limits_.size(); ++i)
      largest = std::max(largest, limits_[i] - std::exp(values[static_cast<Eigen::Index>(i)]));
    return largest;
  }
  double operator()(const Point& point) {
    const Eigen::VectorXd values = at(point);
    return largest_deficit(values) + kPerSquaredPixel * values.tail<2>().squaredNorm();
  }

 private:
  const std::function<FieldValues(const std::vector<double>&)>& measure_;
  const Criteria& criteria_;
  const FieldValues& design_;
  std::vector<double> pose_;       // of the lens
  std::vector<std::size_t> axes_;  // observable ones
  std::optional<std::size_t> z_;
  std::vector<double> limits_;  // in the order of for_each_limit
  std::map<std::vector<double>, FieldValues> known_;
};

// MTFs as functions of z and of the two axes that move the fields' focus most.
class FocusModel {
 public:
  FocusModel(Objective& objective, const Point& start, std::size_t z) : objective_(objective), start_(start), z_(z) {
    for (int place = -kPlaces; place <= kPlaces; ++place) curves_.push_back(objective.at(moved({{z, kStep * place}})));
    for (std::size_t axis = 0; axis < objective.axes(); ++axis) {
      if (axis == z) continue;
      const Tilt tilt{axis, slopes(axis)};
      if (tilt.largest() > kLeastSlope) tilts_.push_back(tilt);
    }
    std::sort(tilts_.begin(), tilts_.end(), [](const Tilt& a, const Tilt& b) { return a.largest() > b.largest(); });
    if (tilts_.size() > Cell().size()) tilts_.erase(tilts_.begin() + Cell().size(), tilts_.end());
  }

  // The lowest local optimum, and others that may be the lowest in truth; the best first.
  std::vector<Point> optima() const {
    const int rows = tilts_.empty() ? 0 : kGrid, columns = tilts_.size() < 2 ? 0 : kGrid;
    std::map<Cell, Focus> grid;
    for (int row = -rows; row <= rows; ++row)
      for (int column = -columns; column <= columns; ++column) grid[{row, column}] = focused({row, column});
    std::vector<std::pair<double, Point>> found;
    for (const auto& [cell, focus] : grid) {
      bool lowest = true;
      for (const int row : {cell[0] - 1, cell[0], cell[0] + 1})
        for (const int column : {cell[1] - 1, cell[1], cell[1] + 1})
          if (const auto other = grid.find({row, column}); other != grid.end() && other->second.deficit < focus.deficit)
            lowest = false;
      if (lowest) found.emplace_back(focus.deficit, tilted(cell, focus.z));
    }
    std::sort(found.begin(), found.end());
    std::vector<Point> best;
    for (const auto& [deficit, point] : found)
      if (best.size() < kMostOptima && deficit < found[0].first + kErrorOfModel) best.push_back(point);
    return best;
  }

 private:
  static constexpr int kPlaces = 15;            // of a curve, on either side
  static constexpr double kStep = 0.01;         // between them, of the travel
  static constexpr int kFiner = 4;              // places of the grid for one of a curve
  static constexpr int kGrid = 24;              // cells on either side
  static constexpr double kLeastSlope = 0.005;  // of travel of z for one of the axis
  static constexpr std::size_t kMostOptima = 4;
  static constexpr double kErrorOfModel = 0.02;  // of MTF: ten times what was seen

  using Cell = std::array<int, 2>;  // steps of each tilt
  struct Focus {
    double deficit = kInfinity, z = 0;
  };
  struct Tilt {
    std::size_t axis;
    Eigen::VectorXd slope;  // of focus, for each limit: travel of z for one of the axis
    double largest() const { return slope.cwiseAbs().maxCoeff(); }
    // Moves the focus of the field that moves most by half a place.
    double step() const { return kStep / 2 / largest(); }
  };

  Point moved(std::initializer_list<std::pair<std::size_t, double>> steps) const {
    Point there = start_;
    for (const auto& [axis, step] : steps) there[axis] = std::clamp(there[axis] + step, 0.0, 1.0);
    return there;
  }
  Point tilted(const Cell& cell, double z) const {
    Point there = moved({{z_, z}});
    for (std::size_t i = 0; i < tilts_.size(); ++i) there[tilts_[i].axis] += cell[i] * tilts_[i].step();
    for (double& place : there) place = std::clamp(place, 0.0, 1.0);
    return there;
  }

  // Logarithm of an MTF at z from the start: Catmull and Rom's cubic through the curve, constant beyond it.
  double curve(Eigen::Index limit, double z) const {
    const double place = std::clamp(z / kStep + kPlaces, 0.0, 2.0 * kPlaces);
    const int before = std::min(static_cast<int>(place), 2 * kPlaces - 1);
    const double t = place - before;
    const auto value = [&](int i) { return curves_[static_cast<std::size_t>(std::clamp(i, 0, 2 * kPlaces))][limit]; };
    const double a = value(before - 1), b = value(before), c = value(before + 1), d = value(before + 2);
    return b + t / 2 * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
  }

  // Least squares: the antisymmetric change of the logarithms by two opposite steps of the axis, on either side of the
  // best focus, is that of their curves at two opposite places, as far apart as a linear function of the field's place
  // says.
  Eigen::VectorXd slopes(std::size_t axis) {
    constexpr double kTilt = 0.02, kAside = 0.03;
    const auto n = static_cast<Eigen::Index>(objective_.limits().size());
    const auto places = objective_.places(start_);
    Eigen::MatrixXd basis(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto& [x, y] = places[static_cast<std::size_t>(i)];
      basis.row(i) << 1, (std::isnan(x) ? 0 : x / 1000), (std::isnan(y) ? 0 : y / 1000);
    }
    const double focus = focused({0, 0}).z;
    Eigen::Matrix3d squares = Eigen::Matrix3d::Identity() * 1e-9;
    Eigen::Vector3d sums = Eigen::Vector3d::Zero();
    for (const double z : {focus - kAside, focus + kAside}) {
      const Eigen::VectorXd change =
          objective_.at(moved({{z_, z}, {axis, kTilt}})) - objective_.at(moved({{z_, z}, {axis, -kTilt}}));
      for (Eigen::Index i = 0; i < n; ++i) {
        constexpr double kNear = kStep / 10;
        const double by_z = (curve(i, z + kNear) - curve(i, z - kNear)) / (2 * kNear);
        const Eigen::Vector3d row = 2 * kTilt * by_z * basis.row(i).transpose();
        squares += row * row.transpose();
        sums += row * change[i];
      }
    }
    return basis * squares.ldlt().solve(sums);
  }

  // The best z of the model in this cell.
  Focus focused(const Cell& cell) const {
    const auto n = static_cast<Eigen::Index>(objective_.limits().size());
    Eigen::VectorXd aside = Eigen::VectorXd::Zero(n);
    for (std::size_t i = 0; i < tilts_.size() && i < cell.size(); ++i)
      aside += cell[i] * tilts_[i].step() * tilts_[i].slope;
    Focus best;
    for (int place = -kPlaces * kFiner; place <= kPlaces * kFiner; ++place) {
      const double z = place * kStep / kFiner;
      double deficit = -kInfinity;
      for (Eigen::Index i = 0; i < n && deficit < best.deficit; ++i)
        deficit =
            std::max(deficit, objective_.limits()[static_cast<std::size_t>(i)] - std::exp(curve(i, z + aside[i])));
      if (deficit < best.deficit) best = {deficit, z};
    }
    return best;
  }

  Objective& objective_;
  Point start_;
  std::size_t z_;
  std::vector<Eigen::VectorXd> curves_;  // Objective::at, for each place
  std::vector<Tilt> tilts_;              // at most two
};

// The optimum near a point, by quadratic models in ever smaller neighbourhoods.
class Descent {
 public:
  explicit Descent(Objective& objective) : objective_(objective) {}

  Point from(Point best) {
    constexpr int kRounds = 6;
    constexpr double kSmallGain = 1e-4;
    for (const double radius : {0.06, 0.03, 0.01, 0.002})  // of the travel
      for (int round = 0; round < kRounds; ++round) {
        const Point next = best_near(best, radius);
        const double gain = objective_(best) - objective_(next);
        if (gain > 0) best = next;
        if (!(gain > kSmallGain)) break;
      }
    return best;
  }

 private:
  // The optimum of a quadratic model of all values, interpolated at distances of `radius`, within twice that radius.
  Point best_near(const Point& middle, double radius) {
    const auto n = static_cast<Eigen::Index>(objective_.axes());
    Point centre = middle;
    for (double& place : centre) place = std::clamp(place, radius, 1 - radius);
    const auto moved = [&](std::initializer_list<std::pair<Eigen::Index, double>> steps) {
      Point there = centre;
      for (const auto& [axis, step] : steps) there[static_cast<std::size_t>(axis)] += step * radius;
      return objective_.at(there);
    };
    const Eigen::VectorXd here = objective_.at(centre);
    std::vector<Eigen::VectorXd> up, slope, model;  // model: second derivatives, j <= k
    for (Eigen::Index k = 0; k < n; ++k) {
      up.push_back(moved({{k, 1}}));
      const Eigen::VectorXd down = moved({{k, -1}});
      slope.push_back((up.back() - down) / 2);
      for (Eigen::Index j = 0; j < k; ++j)
        model.push_back(moved({{j, 1}, {k, 1}}) - up[static_cast<std::size_t>(j)] - up.back() + here);
      model.push_back((up.back() + down) / 2 - here);
    }
    const auto predicted = [&](const std::vector<double>& step) {
      Eigen::VectorXd values = here;
      std::size_t pair = 0;
      for (std::size_t k = 0; k < objective_.axes(); ++k) {
        values += step[k] * slope[k];
        for (std::size_t j = 0; j <= k; ++j) values += step[j] * step[k] * model[pair++];
      }
      return values;
    };
    std::vector<double> step(objective_.axes() + 1, 0.0);  // in radii; then the largest deficit
    for (std::size_t i = 0; i < centre.size(); ++i) step[i] = (middle[i] - centre[i]) / radius;
    descend(predicted, step);
    for (std::size_t i = 0; i < centre.size(); ++i) centre[i] = std::clamp(centre[i] + radius * step[i], 0.0, 1.0);
    return centre;
  }

  // COBYLA (Powell 1994, of NLopt) on the epigraph form of the model: min t + ..., with deficit_i <= t.
  template <class Predicted>
  void descend(const Predicted& predicted, std::vector<double>& step) {
    struct Problem {
      const Objective& objective;
      const Predicted& predicted;
      Eigen::VectorXd at(const double* x, std::size_t count) const {
        return predicted(std::vector<double>(x, x + count));
      }
    } problem{objective_, predicted};
    const auto objective = +[](unsigned count, const double* x, double*, void* data) {
      const Problem& of = *static_cast<Problem*>(data);
      return x[count - 1] + kPerSquaredPixel * of.at(x, count).template tail<2>().squaredNorm();
    };
    const auto constraints = +[](unsigned count, double* result, unsigned size, const double* x, double*, void* data) {
      const Problem& of = *static_cast<Problem*>(data);
      const Eigen::VectorXd values = of.at(x, size);
      for (unsigned i = 0; i < count; ++i)
        result[i] = of.objective.limits()[i] - std::exp(std::min(0.0, values[i])) - x[size - 1];
    };
    const auto count = static_cast<unsigned>(step.size());
    step.back() = objective_.largest_deficit(problem.at(step.data(), count));
    nlopt::opt opt(nlopt::LN_COBYLA, count);
    std::vector<double> lower(count, -2), upper(count, 2), strides(count, 0.5);
    strides.back() = 0.1;
    opt.set_lower_bounds(lower);
    opt.set_upper_bounds(upper);
    opt.set_initial_step(strides);
    opt.set_min_objective(objective, &problem);
    opt.add_inequality_mconstraint(constraints, &problem, std::vector<double>(objective_.limits().size(), 1e-7));
    opt.set_xtol_abs(1e-4);
    opt.set_maxeval(1000);
    double lowest = 0;
    try {
      opt.optimize(step, lowest);
    } catch (const nlopt::roundoff_limited&) {  // as good as it gets
    }
  }

  Objective& objective_;
};

}  // namespace

Judge::Optimum criterion_optimum(const std::function<FieldValues(const std::vector<double>&)>& measure,
                                 const SceneFacts& scene, const Criteria& criteria, const FieldValues& design,
                                 const std::vector<double>& start) {
  Objective objective(measure, scene, criteria, design, start);
  Point best = objective.point_of(start);
  std::vector<Point> starts = {best};
  if (objective.z()) starts = FocusModel(objective, best, *objective.z()).optima();
  Descent descent(objective);
  for (const Point& from : starts) {
    const Point found = descent.from(from);
    if (objective(found) < objective(best)) best = found;
  }
  for (double& place : best) place = std::clamp(std::round(place * kPerTravel) / kPerTravel, 0.0, 1.0);
  return {objective.posed(best), objective.largest_deficit(objective.at(best))};
}

}  // namespace relign::trials
