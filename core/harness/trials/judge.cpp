#include "trials/judge.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlopt.hpp>
#include <numeric>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "base/text.h"

namespace relign::trials {
namespace {

constexpr double kPerSquaredPixel = 1e-4;
constexpr double kPerTravel = 1e5;  // poses are rounded to this part of it
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Shift {
  double x_px = kNaN, y_px = kNaN, rotation = kNaN;  // radians
};

// Over the fields that both images show.
Shift shift_of(const FieldValues& fields, const FieldValues& design) {
  double n = 0, x = 0, y = 0, from_x = 0, from_y = 0;
  const auto each = [&](const auto& body) {
    for (std::size_t i = 0; i < fields.size(); ++i)
      if (!std::isnan(fields[i].x_px) && !std::isnan(design[i].x_px))
        body(design[i].x_px, design[i].y_px, fields[i].x_px - design[i].x_px, fields[i].y_px - design[i].y_px);
  };
  each([&](double at_x, double at_y, double dx, double dy) {
    n += 1;
    x += dx;
    y += dy;
    from_x += at_x;
    from_y += at_y;
  });
  double moment = 0, inertia = 0;
  each([&](double at_x, double at_y, double dx, double dy) {
    const double u = at_x - from_x / n, v = at_y - from_y / n;
    moment += u * (dy - y / n) - v * (dx - x / n);
    inertia += u * u + v * v;
  });
  return {x / n, y / n, moment / inertia};  // NaN without a field, or with one for the rotation
}

// What a criterion is judged by.
struct PoseFacts {
  const SceneFacts& scene;
  const std::vector<double>& true_pose;
  const std::vector<double>& own_optimum;  // true pose; empty if unknown
  const FieldValues& design;               // of the perfect lens at the nominal pose
  const FieldValues* fields = nullptr;  // at this pose; null, and what follows unknown, where no criterion needs them
  std::vector<double> deficits = {};    // limit - MTF, of all fields and directions with a limit
  Shift shift = {};                     // of the fields' image against the design's
};

// Distance from the own optimum over the observable axes of this unit, Euclidean.
double distance(const PoseFacts& at, std::string_view unit) {
  if (at.own_optimum.empty()) return kNaN;
  double squares = 0;
  for (std::size_t i = 0; i < at.scene.axes.size(); ++i) {
    const Axis& axis = at.scene.axes[i];
    if (!axis.observable || axis.unit != unit) continue;
    const double away = (at.true_pose[i] - at.own_optimum[i]) * axis.travel();
    squares += away * away;
  }
  return std::sqrt(squares);
}

struct JudgedCriterion {
  std::string_view column;  // as in kCriterionEntries
  double (*value)(const PoseFacts&);
};
constexpr std::array kJudged = {
    JudgedCriterion{"field_mtf_deficit",
                    [](const PoseFacts& at) {
                      return at.deficits.empty() ? kNaN : *std::max_element(at.deficits.begin(), at.deficits.end());
                    }},
    JudgedCriterion{
        "centre_px",
        [](const PoseFacts& at) { return std::sqrt(at.shift.x_px * at.shift.x_px + at.shift.y_px * at.shift.y_px); }},
    JudgedCriterion{"rotation_px",
                    [](const PoseFacts& at) {
                      const double width = at.scene.image_width, height = at.scene.image_height;
                      return std::fabs(at.shift.rotation) * std::sqrt(width * width + height * height) / 2;
                    }},
    JudgedCriterion{"pose_um", [](const PoseFacts& at) { return 1000 * distance(at, "mm"); }},
    JudgedCriterion{"tilt_arcmin", [](const PoseFacts& at) { return 60 * distance(at, "deg"); }},
};
static_assert(std::equal(kJudged.begin(), kJudged.end(), kCriterionEntries.begin(),
                         kCriterionEntries.end() - kMostFurtherScores,
                         [](const JudgedCriterion& judged, const CriterionEntry& entry) {
                           return judged.column == entry.column;
                         }),
              "every entry of kCriterionEntries needs its function here, in the same order; the scene has those of "
              "further scores");

}  // namespace

bool Criteria::any() const {
  return std::any_of(kCriteria.begin(), kCriteria.end(), [&](Criterion one) { return judged[one]; });
}

bool Criteria::needs(CriterionNeeds what) const {
  return std::any_of(kCriteria.begin(), kCriteria.end(),
                     [&](Criterion one) { return judged[one] && entry_of(one).needs == what; });
}

Criteria criteria_of(const records::Specification& spec, const SceneFacts& scene) {
  Criteria criteria;
  for (const Criterion one : kCriteria) criteria.judged[one] = !std::isnan(spec.limits[one]);
  for (std::size_t i = 0; i < scene.score.further.size(); ++i) criteria.judged[further_score(i)] = true;
  if (!criteria.judged[Criterion::field_mtf]) return criteria;
  criteria.lp_per_mm = spec.field_mtf.lp_per_mm;
  std::vector<std::string> names;
  for (const images::EdgeField& field : scene.fields) names.push_back(field.name);
  if (spec.field_mtf.fields.empty())
    for (std::uint32_t i = 0; i < names.size(); ++i)
      criteria.field_mtf.push_back({i, spec.field_mtf.every.tangential, spec.field_mtf.every.sagittal});
  for (const records::FieldLimits& limits : spec.field_mtf.fields) {
    const auto found = std::find(names.begin(), names.end(), limits.name);
    if (found == names.end())
      throw Error(ErrorKind::bad_input, "the specification's 'field_mtf' has the unknown field '" + limits.name +
                                            "'; fields of the scene '" + scene.name + "': " + join(names, ", "));
    criteria.field_mtf.push_back(
        {static_cast<std::uint32_t>(found - names.begin()), limits.tangential, limits.sagittal});
  }
  return criteria;
}

FieldValues measure_fields(plugin_host::MountedAssembly& lens, const SceneFacts& scene, double lp_per_mm,
                           const std::vector<double>& true_pose) {
  std::vector<std::uint32_t> which(scene.fields.size());
  std::iota(which.begin(), which.end(), 0U);
  FieldValues values = lens.fields(true_pose, lp_per_mm, which);
  if (values.empty())
    throw Error(ErrorKind::bad_input, "the scene '" + scene.name + "' does not offer " RELIGN_SCENE_FIELDS);
  return values;
}

FieldValues design_fields(plugin_host::MountedAssembly& perfect, const SceneFacts& scene, const Criteria& criteria) {
  if (!criteria.needs(CriterionNeeds::fields)) return {};
  return measure_fields(perfect, scene, criteria.lp_per_mm, scene.nominal_pose);
}

const FieldValues& Judge::fields_at(const std::vector<double>& true_pose) {
  auto found = known_.find(true_pose);
  if (found == known_.end())
    found = known_.emplace(true_pose, measure_fields(lens_, scene_, lp_per_mm_, true_pose)).first;
  return found->second;
}

const std::vector<double>& Judge::further_scores_at(const std::vector<double>& true_pose) {
  std::vector<double>& found = known_further_[true_pose];
  for (std::size_t i = found.size(); i < scene_.score.further.size(); ++i) {
    const std::string name =
        "the scene '" + scene_.name + "' declares the further score '" + scene_.score.further[i].name + "', but ";
    std::optional<double> value;
    try {
      value = lens_.further_score(true_pose, seed_, static_cast<std::uint32_t>(i));
    } catch (const Error& error) {
      throw Error(error.kind(), name + "measuring it failed: " + error.what());
    }
    if (!value)
      throw Error(ErrorKind::plugin_failed, name + "its assembly gives none (" RELIGN_SCENE_FURTHER_SCORE
                                                   "; in Python further_score is missing, or returned None)");
    if (*value < 0) throw Error(ErrorKind::plugin_failed, name + "returned " + shortest(*value) + "; it is from 0");
    found.push_back(*value);
  }
  return found;
}

std::vector<double> Judge::deficits(const FieldValues& fields) const {
  std::vector<double> all;
  for_each_limit(criteria_, [&](double least, auto field, auto mtf) { all.push_back(least - fields[field].*mtf); });
  return all;
}

ByCriterion<double> Judge::at(const std::vector<double>& true_pose, const std::vector<double>& own_optimum) {
  PoseFacts facts{scene_, true_pose, own_optimum, design_};
  if (criteria_.needs(CriterionNeeds::fields)) {
    facts.fields = &fields_at(true_pose);
    facts.deficits = deficits(*facts.fields);
    facts.shift = shift_of(*facts.fields, design_);
  }
  ByCriterion<double> values = records::Specification::none();
  for (const Criterion one : kCriteria)
    if (criteria_.judged[one] && !is_further_score(one))
      values[one] = kJudged[static_cast<std::size_t>(one)].value(facts);
  for (std::size_t i = 0; i < scene_.score.further.size(); ++i)
    values[further_score(i)] = further_scores_at(true_pose)[i];
  return values;
}

// The search of optimum(): minimises the largest deficit plus kPerSquaredPixel times the squared shift of the image.
class Judge::Search {
 public:
  Search(Judge& judge, const std::vector<double>& start)
      : judge_(judge), pose_(start), axes_(judge.scene_.observable_axes()) {
    for_each_limit(judge.criteria_, [this](double least, auto, auto) { limits_.push_back(least); });
  }

  Optimum run() {
    const Point start = point_of(pose_);
    set_frequency(kCoarsest);
    Point best = focused(start);
    for (const Stage& stage : {Stage{kCoarsest, 0.03}, {0.5, 0.03}, {1, 0.03}, {1, 0.01}, {1, 0.002}}) {
      set_frequency(stage.frequency);
      for (int round = 0; round < kRounds; ++round) {
        const Point next = best_near(best, stage.radius);
        const double gain = value(best) - value(next);
        if (gain > 0) best = next;
        if (!(gain > kSmallGain)) break;
      }
    }
    if (value(start) < value(best)) best = start;
    for (double& place : best) place = std::clamp(std::round(place * kPerTravel) / kPerTravel, 0.0, 1.0);
    Optimum found{posed(best), largest_deficit(at(best))};
    judge_.known_.clear();
    return found;
  }

 private:
  using Point = std::vector<double>;  // along the observable axes
  struct Stage {
    double frequency, radius;  // shares of the specification's, and of the travel
  };
  static constexpr double kCoarsest = 0.25;  // of the frequency: there the MTF still falls steadily with blur
  static constexpr int kRounds = 6;
  static constexpr double kSmallGain = 1e-4;

  void set_frequency(double share) {
    judge_.lp_per_mm_ = share * judge_.criteria_.lp_per_mm;
    judge_.known_.clear();
  }

  Point point_of(const std::vector<double>& pose) const {
    Point point;
    for (const std::size_t axis : axes_) point.push_back(pose[axis]);
    return point;
  }
  const std::vector<double>& posed(const Point& point) {
    for (std::size_t i = 0; i < axes_.size(); ++i) pose_[axes_[i]] = std::clamp(point[i], 0.0, 1.0);
    return pose_;
  }

  // Logarithms of the limited MTFs, then the shift in pixels: nearly quadratic functions of the pose. A shift that is
  // unknown counts as 100 pixels.
  Eigen::VectorXd at(const Point& point) {
    constexpr double kDarkest = 1e-4, kUnknownShift_px = 100;
    const FieldValues& fields = judge_.fields_at(posed(point));
    Eigen::VectorXd values(static_cast<Eigen::Index>(limits_.size()) + 2);
    Eigen::Index next = 0;
    for_each_limit(judge_.criteria_, [&](double, auto field, auto mtf) {
      values[next++] = std::log(std::max(fields[field].*mtf, kDarkest));
    });
    const Shift shift = shift_of(fields, judge_.design_);
    values[next] = std::isnan(shift.x_px) ? kUnknownShift_px : shift.x_px;
    values[next + 1] = std::isnan(shift.y_px) ? 0 : shift.y_px;
    return values;
  }
  double largest_deficit(const Eigen::VectorXd& values) const {
    double largest = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < limits_.size(); ++i)
      largest = std::max(largest, limits_[i] - std::exp(values[static_cast<Eigen::Index>(i)]));
    return largest;
  }
  double value_of(const Eigen::VectorXd& values) const {
    return largest_deficit(values) + kPerSquaredPixel * values.tail<2>().squaredNorm();
  }
  double value(const Point& point) { return value_of(at(point)); }

  // The pose of least score may be out of focus: the sharpest place along z.
  Point focused(const Point& start) {
    constexpr int kPlaces = 15;  // on either side
    constexpr double kStep = 0.01;
    Point best = start;
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      if (judge_.scene_.axes[axes_[i]].name != "z") continue;
      for (int place = -kPlaces; place <= kPlaces; ++place) {
        Point there = start;
        there[i] = std::clamp(start[i] + kStep * place, 0.0, 1.0);
        if (value(there) < value(best)) best = there;
      }
    }
    return best;
  }

  // The optimum of a quadratic model of all values, interpolated at distances of `radius`, within twice that radius.
  Point best_near(const Point& middle, double radius) {
    const auto n = static_cast<Eigen::Index>(axes_.size());
    Point centre = middle;
    for (double& place : centre) place = std::clamp(place, radius, 1 - radius);
    const auto moved = [&](std::initializer_list<std::pair<Eigen::Index, double>> steps) {
      Point there = centre;
      for (const auto& [axis, step] : steps) there[static_cast<std::size_t>(axis)] += step * radius;
      return at(there);
    };
    const Eigen::VectorXd here = at(centre);
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
      for (std::size_t k = 0; k < axes_.size(); ++k) {
        values += step[k] * slope[k];
        for (std::size_t j = 0; j <= k; ++j) values += step[j] * step[k] * model[pair++];
      }
      return values;
    };
    std::vector<double> step(axes_.size() + 1, 0.0);  // in radii; then the largest deficit
    for (std::size_t i = 0; i < centre.size(); ++i) step[i] = (middle[i] - centre[i]) / radius;
    descend(predicted, step);
    for (std::size_t i = 0; i < centre.size(); ++i) centre[i] = std::clamp(centre[i] + radius * step[i], 0.0, 1.0);
    return centre;
  }

  // COBYLA (Powell 1994, of NLopt) on the epigraph form of the model: min t + ..., with deficit_i <= t.
  template <class Predicted>
  void descend(const Predicted& predicted, std::vector<double>& step) {
    struct Problem {
      const Search& search;
      const Predicted& predicted;
      Eigen::VectorXd at(const double* x, std::size_t count) const {
        return predicted(std::vector<double>(x, x + count));
      }
    } problem{*this, predicted};
    const auto objective = +[](unsigned count, const double* x, double*, void* data) {
      const Problem& of = *static_cast<Problem*>(data);
      return x[count - 1] + kPerSquaredPixel * of.at(x, count).template tail<2>().squaredNorm();
    };
    const auto constraints = +[](unsigned count, double* result, unsigned size, const double* x, double*, void* data) {
      const Problem& of = *static_cast<Problem*>(data);
      const Eigen::VectorXd values = of.at(x, size);
      for (unsigned i = 0; i < count; ++i)
        result[i] = of.search.limits_[i] - std::exp(std::min(0.0, values[i])) - x[size - 1];
    };
    const auto count = static_cast<unsigned>(step.size());
    step.back() = largest_deficit(problem.at(step.data(), count));
    nlopt::opt opt(nlopt::LN_COBYLA, count);
    std::vector<double> lower(count, -2), upper(count, 2), strides(count, 0.5);
    strides.back() = 0.1;
    opt.set_lower_bounds(lower);
    opt.set_upper_bounds(upper);
    opt.set_initial_step(strides);
    opt.set_min_objective(objective, &problem);
    opt.add_inequality_mconstraint(constraints, &problem, std::vector<double>(limits_.size(), 1e-7));
    opt.set_xtol_abs(1e-4);
    opt.set_maxeval(1000);
    double lowest = 0;
    try {
      opt.optimize(step, lowest);
    } catch (const nlopt::roundoff_limited&) {  // as good as it gets
    }
  }

  Judge& judge_;
  std::vector<double> pose_;       // of the lens
  std::vector<std::size_t> axes_;  // observable ones
  std::vector<double> limits_;     // in the order of for_each_limit
};

std::optional<Judge::Optimum> Judge::optimum(const std::vector<double>& start) {
  if (criteria_.field_mtf.empty()) return std::nullopt;
  return Search(*this, start).run();
}

}  // namespace relign::trials
