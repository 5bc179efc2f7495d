// Summary of a noise level's draws: means and standard deviations of start, distortion and element offsets, and the
// correlation of the offsets.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>
#include <string>
#include <utility>
#include <vector>

#include "least_squares/poses.hpp"

namespace tolerance_fit {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

using least_squares::to_pose;
using least_squares::to_vector;

// A shift or tilt of one element.
struct Offset {
  std::string element;
  bool tilt = false;
  std::size_t axis = 0;
  bool operator<(const Offset& other) const {
    return std::tie(element, tilt, axis) < std::tie(other.element, other.tilt, other.axis);
  }
};

// Offsets in the JSON format of `mount`. values: mm or degrees.
inline std::string offsets_json(const std::vector<Offset>& offsets, const Vector& values) {
  nlohmann::json elements = nlohmann::json::object();
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    nlohmann::json& element = elements[offsets[i].element];
    if (element.is_null()) element = {{"shift_mm", {0.0, 0.0, 0.0}}, {"tilt_deg", {0.0, 0.0}}};
    element[offsets[i].tilt ? "tilt_deg" : "shift_mm"][offsets[i].axis] = values[static_cast<Eigen::Index>(i)];
  }
  return elements.dump();
}

struct Level {
  Vector start_mean, start_std;            // per axis
  Matrix distortion_mean, distortion_std;  // per entry
  std::vector<Offset> offsets;             // those that vary or are not 0
  Vector offset_mean, offset_std;
  Matrix offset_correlation;
  std::vector<relign::Pose> starts;  // as drawn
};

namespace detail {

inline Vector mean_of(const Matrix& samples) { return samples.rowwise().mean(); }

inline Vector std_of(const Matrix& samples) {
  const Matrix centred = samples.colwise() - mean_of(samples);
  return (centred.rowwise().squaredNorm() / std::max<double>(1, static_cast<double>(samples.cols() - 1))).cwiseSqrt();
}

// Sets correlations below five standard errors to 0, so that chance does not couple independent offsets.
inline Matrix correlation_of(const Matrix& samples, const Vector& mean, const Vector& std) {
  const Matrix scaled = std.cwiseInverse().asDiagonal() * (samples.colwise() - mean);
  const auto count = static_cast<double>(samples.cols());
  Matrix correlation = scaled * scaled.transpose() / (count - 1);
  for (Eigen::Index i = 0; i < correlation.rows(); ++i)
    for (Eigen::Index j = 0; j < correlation.cols(); ++j) {
      if (i == j) correlation(i, j) = 1;
      if (i != j && std::fabs(correlation(i, j)) < 5 / std::sqrt(count)) correlation(i, j) = 0;
    }
  return correlation;
}

}  // namespace detail

// draws: at least two, in the JSON format of relign.prior/1.
inline Level summarise(const std::vector<std::string>& draws, std::size_t axes) {
  const auto n = static_cast<Eigen::Index>(axes), count = static_cast<Eigen::Index>(draws.size());
  Matrix starts(n, count), distortions(n * n, count);
  std::vector<std::map<Offset, double>> drawn_offsets;
  std::map<Offset, double> known;
  Level level;
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto drawn = nlohmann::json::parse(draws[static_cast<std::size_t>(k)]);
    level.starts.push_back(drawn.at("start").get<relign::Pose>());
    const auto rows = drawn.at("distortion").get<std::vector<std::vector<double>>>();
    for (Eigen::Index i = 0; i < n; ++i) {
      starts(i, k) = level.starts.back().at(static_cast<std::size_t>(i));
      for (Eigen::Index j = 0; j < n; ++j)
        distortions(i * n + j, k) = rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j));
    }
    std::map<Offset, double> values;
    const auto elements = drawn.value("elements", nlohmann::json::object());
    for (const auto& [element, offset] : elements.items())
      for (const bool tilt : {false, true}) {
        const auto numbers = offset.value(tilt ? "tilt_deg" : "shift_mm", std::vector<double>{});
        for (std::size_t axis = 0; axis < numbers.size(); ++axis)
          known[{element, tilt, axis}] = values[{element, tilt, axis}] = numbers[axis];
      }
    drawn_offsets.push_back(std::move(values));
  }
  level.start_mean = detail::mean_of(starts);
  level.start_std = detail::std_of(starts);
  level.distortion_mean = detail::mean_of(distortions).reshaped<Eigen::RowMajor>(n, n);
  level.distortion_std = detail::std_of(distortions).reshaped<Eigen::RowMajor>(n, n);

  std::vector<Vector> varied;
  for (const auto& [offset, last] : known) {
    Vector row = Vector::Zero(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto& values = drawn_offsets[static_cast<std::size_t>(k)];
      if (const auto found = values.find(offset); found != values.end()) row[k] = found->second;
    }
    if (row.maxCoeff() - row.minCoeff() <= 0 && last == 0) continue;
    level.offsets.push_back(offset);
    varied.push_back(std::move(row));
  }
  Matrix samples(static_cast<Eigen::Index>(varied.size()), count);
  for (std::size_t i = 0; i < varied.size(); ++i) samples.row(static_cast<Eigen::Index>(i)) = varied[i].transpose();
  level.offset_mean = detail::mean_of(samples);
  level.offset_std = detail::std_of(samples).cwiseMax(1e-12);
  level.offset_correlation = detail::correlation_of(samples, level.offset_mean, level.offset_std);
  return level;
}

}  // namespace tolerance_fit
