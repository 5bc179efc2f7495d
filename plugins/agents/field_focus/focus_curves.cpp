#include "focus_curves.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace field_focus {
namespace {

constexpr double kLowest = 0.12;     // MTF below which contrast may be reversed
constexpr double kOfPeak = 0.3;      // share of a channel's highest MTF below which the curve is not Gaussian
constexpr double kWidthPrior = 0.1;  // weight of the median width; a capture in focus and one a reach away have 1 each
constexpr double kSharpness = 80;    // of the soft minimum: channels within 1 / 80 of the lowest count
constexpr double kFloor = 0.05;      // root of the weight that samples far from the focus keep

// Of near curves. Errors of log MTF: noise of captures and of the mean of two edges, and what polynomials miss.
constexpr double kDimmest = 0.2;  // MTF
constexpr double kNoise = 0.0125, kRest = 0.01;
constexpr double kFar = 0.02;  // times the cube of the distance in reaches

// Of curves like the design's: standard deviations of the factor's logarithm, of the shift of one pass in reaches, and
// of the coefficients from the second power on.
constexpr double kLikeDesign[] = {0.3, 1.5, 0.05, 0.03, 0.015};
constexpr double kFarthest = 2.3;  // reaches from the best focus: farther samples may be of reversed contrast
constexpr int kPasses = 4;

// Normal equations of log m = p0 + p1 s + p2 s^2, s = (zeta - middle) / reach.
struct Parabola {
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double middle = 0;
  int samples = 0;
};

Parabola sum_up(const Channel& channel, double reach) {
  Parabola sums;
  const Sample* highest = nullptr;
  for (const Sample& sample : channel.samples)
    if (sample.mtf > (highest ? highest->mtf : kLowest)) highest = &sample;
  if (!highest) return sums;
  sums.middle = channel.defocus(highest->pose);
  for (const Sample& sample : channel.samples) {
    if (!(sample.mtf > std::max(kLowest, kOfPeak * highest->mtf))) continue;
    const double s = (channel.defocus(sample.pose) - sums.middle) / reach;
    const double weight = sample.mtf * sample.mtf * std::exp(-0.5 * s * s) + kFloor * kFloor;
    const Eigen::Vector3d row(1, s, s * s);
    sums.squares += weight * row * row.transpose();
    sums.right += weight * std::log(sample.mtf) * row;
    ++sums.samples;
  }
  return sums;
}

std::optional<Curve> solve(const Parabola& sums, double reach) {
  const Eigen::Vector3d p = sums.squares.ldlt().solve(sums.right);
  if (!p.allFinite() || !(p[2] < 0)) return std::nullopt;
  const double vertex = -0.5 * p[1] / p[2];
  return Curve{p[0] + 0.5 * p[1] * vertex, sums.middle + reach * vertex, reach * std::sqrt(-0.5 / p[2])};
}

// Of log MTF, of a sample `away` reaches from the middle.
double variance_of(const Sample& sample, double away) {
  const double far = kFar * away * away * away;
  return std::pow(kNoise / sample.mtf, 2) + kRest * kRest + far * far + sample.doubt * sample.doubt;
}

}  // namespace

int fit(std::vector<Channel>& channels, double reach) {
  std::vector<Parabola> sums;
  std::vector<double> widths;
  for (const Channel& channel : channels) {
    sums.push_back(sum_up(channel, reach));
    if (sums.back().samples < 3) continue;
    if (const auto curve = solve(sums.back(), reach)) widths.push_back(curve->width);
  }
  if (widths.empty()) {
    for (Channel& channel : channels) channel.curve.reset();
    return 0;
  }
  std::nth_element(widths.begin(), widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2), widths.end());
  const double width = widths[widths.size() / 2] / reach;
  const double prior = kWidthPrior * std::pow(width, 4);
  int fitted = 0;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    channels[i].curve.reset();
    if (sums[i].samples < 2) continue;
    sums[i].squares(2, 2) += prior;
    sums[i].right[2] += prior * (-0.5 / (width * width));
    channels[i].curve = solve(sums[i], reach);
    if (channels[i].curve) ++fitted;
  }
  return fitted;
}

int fit_near(std::vector<Channel>& channels, const Focus& pose, double reach) {
  using Powers = NearCurve::Powers;
  // Means and standard deviations of the coefficients, from rays through camera_2mp with tolerances; a reach is 30 um.
  const Powers mean = (Powers() << -0.5, 0, -0.33, 0, 0).finished();
  const Powers spread = (Powers() << 0.6, 1.5, 0.15, 0.08, 0.035).finished();
  int fitted = 0;
  for (Channel& channel : channels) {
    channel.near.reset();
    NearCurve curve{channel.defocus(pose), reach, {}};
    Eigen::Matrix<double, 5, 5> squares = spread.cwiseInverse().cwiseAbs2().asDiagonal();
    Powers right = squares * mean;
    int samples = 0;
    for (const Sample& sample : channel.samples) {
      const double zeta = channel.defocus(sample.pose), away = std::fabs(zeta - curve.middle) / reach;
      if (!(sample.mtf > kDimmest)) continue;
      const double variance = variance_of(sample, away);
      const Powers row = curve.powers(zeta);
      squares += row * row.transpose() / variance;
      right += std::log(sample.mtf) / variance * row;
      ++samples;
    }
    if (samples < 2) continue;
    curve.coefficients = squares.ldlt().solve(right);
    channel.near = curve;
    ++fitted;
  }
  return fitted;
}

DesignCurve::DesignCurve(double first, double stride, std::vector<double> log_mtf)
    : first_(first), stride_(stride), values_(std::move(log_mtf)) {
  const auto highest = std::max_element(values_.begin() + 1, values_.end() - 1);
  const double bend = *(highest - 1) - 2 * *highest + *(highest + 1);
  const double share = bend < 0 ? std::clamp(0.5 * (*(highest - 1) - *(highest + 1)) / bend, -0.5, 0.5) : 0;
  best_ = first_ + stride_ * (static_cast<double>(highest - values_.begin()) + share);
}

double DesignCurve::at(double away) const {
  const auto last = static_cast<double>(values_.size() - 1);
  const double place = std::clamp((best_ + away - first_) / stride_, 0.0, last);
  const auto left = static_cast<std::size_t>(std::clamp(std::floor(place), 1.0, last - 2));
  const double t = place - static_cast<double>(left);
  const double* p = values_.data() + left;
  // The cubic through two values on either side.
  return -t * (t - 1) * (t - 2) / 6 * p[-1] + (t + 1) * (t - 1) * (t - 2) / 2 * p[0] -
         (t + 1) * t * (t - 2) / 2 * p[1] + (t + 1) * t * (t - 1) / 6 * p[2];
}

void fit_by_design(std::vector<Channel>& channels, const std::vector<DesignCurve>& design, const Focus& pose,
                   double reach) {
  using Powers = NearCurve::Powers;
  const Powers prior = Eigen::Map<const Powers>(kLikeDesign).cwiseInverse().cwiseAbs2();
  for (std::size_t i = 0; i < channels.size(); ++i) {
    Channel& channel = channels[i];
    channel.curve = {0, channel.defocus(pose) + design[i].best(), reach};
    for (int pass = 0; pass < kPasses; ++pass) {
      Eigen::Matrix<double, 5, 5> squares = prior.asDiagonal();
      Powers right = Powers::Zero();
      for (const Sample& sample : channel.samples) {
        const double away = channel.defocus(sample.pose) - channel.curve->centre, s = away / reach;
        if (!(sample.mtf > kDimmest) || std::fabs(s) > kFarthest) continue;
        const double variance = variance_of(sample, std::fabs(s));
        const Powers row = (Powers() << 1, -design[i].slope(away) * reach, s * s, s * s * s, s * s * s * s).finished();
        squares += row * row.transpose() / variance;
        right += (std::log(sample.mtf) - design[i].at(away)) / variance * row;
      }
      // The polynomial has no linear term, so that it does not move the best focus.
      channel.curve->centre += reach * squares.ldlt().solve(right)[1];
    }
  }
}

Focus plane_of_best_focus(const std::vector<Channel>& channels) {
  Eigen::Matrix3d squares = 1e-9 * Eigen::Matrix3d::Identity();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Channel& channel : channels) {
    if (!channel.curve) continue;
    const Eigen::Vector3d row(1, -channel.slope[0], -channel.slope[1]);
    squares += row * row.transpose();
    right += channel.curve->centre * row;
  }
  return squares.ldlt().solve(right);
}

Focus best_of_worst(const std::vector<Channel>& channels, const Focus& start, double reach) {
  Eigen::Vector3d scale(1, 0, 0);  // strides that change the defocus of some field by the same
  for (const Channel& channel : channels)
    for (int k = 0; k < 2; ++k) scale[1 + k] = std::max(scale[1 + k], std::fabs(channel.slope[k]));
  const auto value = [&](const Focus& pose) {
    double sum = 0;
    for (const Channel& channel : channels) {
      if (!channel.near) continue;
      if (channel.limit) sum += std::exp(-kSharpness * (channel.near->at(channel.defocus(pose)) - *channel.limit));
      if (std::fabs(channel.defocus(pose) - channel.defocus(start)) > reach) return -1.0;
    }
    return -std::log(sum) / kSharpness;
  };
  Focus best = start;
  double highest = value(best);
  // The soft minimum is smooth: compass search along axes and diagonals of the two tilts.
  for (double stride = 0.25 * reach; stride > 1e-4 * reach;) {
    bool better = false;
    for (int way = 0; way < 27; ++way) {
      Focus next = best;
      for (int k = 0, digits = way; k < 3; ++k, digits /= 3)
        if (scale[k] > 0) next[k] += stride * (digits % 3 - 1) / scale[k];
      const double now = value(next);
      if (now > highest) highest = now, best = next, better = true;
    }
    if (!better) stride *= 0.5;
  }
  return best;
}

}  // namespace field_focus
