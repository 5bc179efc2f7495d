// Data computed from scene and noise level before the first capture: pixel noise, observable combinations of offsets,
// strides for differences, images at distant starts. It does not depend on the trial.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "pictures.hpp"

namespace tolerance_fit {

struct Knowledge {
  Level level;
  Vector nominal;
  double gain = 0, dark = 0;  // variance of a pixel = gain * mean + dark
  double floor = 0;           // least variance, for weights
  // Uncorrelated combinations of offsets with variance 1 each, the best observable ones first.
  std::vector<Offset> offsets;
  Vector offset_mean;
  Matrix combinations;
  // Information about (pose, state) at the nominal pose of the design: one fine capture plus the level as prior.
  Matrix directions;   // eigenvectors, one per column
  Vector information;  // eigenvalues, in noise perturbations per squared unit
  Matrix optimum_by_state;
  Detail fine, middle, coarse;
  std::vector<Vector> far_poses, far_pictures;  // coarse

  Eigen::Index axes() const { return nominal.size(); }
  // Perturbations of a capture's bins.
  Vector variance(const Vector& picture, Detail detail) const {
    const auto pixels = static_cast<double>(detail.bin * detail.bin);
    return ((gain * picture).cwiseMax(0).array() + dark).cwiseMax(floor) / pixels;
  }
  // Expected mean squared residual, in units of variance(), if it is noise alone.
  double expected_misfit(const Vector& picture, Detail detail) const {
    const auto pixels = static_cast<double>(detail.bin * detail.bin);
    const Vector expected = ((gain * picture).cwiseMax(0).array() + dark) / pixels;
    return expected.cwiseQuotient(variance(picture, detail)).mean() * noise_left(detail);
  }
  // Change of the image by a step of (pose, state), in standard deviations of noise.
  double distance(const Vector& step) const {
    return std::sqrt((directions.transpose() * step).cwiseAbs2().dot(information));
  }
};

namespace detail {

inline Matrix square_root(const Matrix& positive) {
  if (positive.size() == 0) return positive;
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(positive);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() *
         solver.eigenvectors().transpose();
}

// Solves the normal equations; directions without information stay 0.
inline Vector solve(const Matrix& squares, const Vector& right) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(squares);
  const double smallest = 1e-9 * std::max(solver.eigenvalues().maxCoeff(), 1e-300);
  const Vector inverse = solver.eigenvalues().unaryExpr([&](double v) { return v > smallest ? 1 / v : 0.0; });
  return solver.eigenvectors() * (inverse.asDiagonal() * (solver.eigenvectors().transpose() * right));
}

// Fits variance = gain * mean + dark to the difference between a capture of the design and its noise-free image, from
// the means over the darker and the brighter half of the pixels.
inline void learn_noise(Knowledge& known, Pictures& pictures) {
  const Vector none = Vector::Zero(pictures.states());
  const std::vector<float> clean = pictures.pixels(known.nominal, none, 0),
                           noisy = pictures.pixels(known.nominal, none, 1);
  std::vector<float> sorted = clean;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  double dark = 0, dark_power = 0, dark_count = 0, light = 0, light_power = 0, light_count = 0, brightest = 0;
  for (std::size_t i = 0; i < clean.size(); ++i) {
    const double error = noisy[i] - clean[i], power = error * error;
    const bool is_dark = clean[i] <= *middle;
    (is_dark ? dark : light) += clean[i];
    (is_dark ? dark_power : light_power) += power;
    (is_dark ? dark_count : light_count) += 1;
    brightest = std::max<double>(brightest, clean[i]);
  }
  const double dark_mean = dark / std::max(dark_count, 1.0), light_mean = light / std::max(light_count, 1.0);
  const double dark_variance = dark_power / std::max(dark_count, 1.0);
  const double light_variance = light_power / std::max(light_count, 1.0);
  known.gain = light_mean > dark_mean ? std::max(0.0, (light_variance - dark_variance) / (light_mean - dark_mean)) : 0;
  known.dark = std::max(0.0, dark_variance - known.gain * dark_mean);
  // Bounds the weight of pixels that are dark in the model but bright in a capture.
  known.floor = std::max({0.02 * known.gain * brightest, 1e-6 * brightest * brightest, 1e-12});
}

// Pictures that come with derivatives are noisy, as are averages of captures.
inline void learn_picture_noise(Knowledge& known, std::uint32_t rays, Pictures& pictures) {
  const Vector none = Vector::Zero(pictures.states());
  known.fine.rays = rays;
  known.middle.rays = known.coarse.rays = std::max(rays / 4, 1U);
  for (Detail* detail : {&known.middle, &known.coarse}) detail->noise = 1.0 / detail->captures;
  const auto found = pictures.slopes(known.nominal, none, known.fine, 0);
  if (!found) return;
  const Vector clean = pictures.look(known.nominal, none, known.fine);
  known.fine.noise = (found->first - clean).cwiseAbs2().cwiseQuotient(known.variance(clean, known.fine)).mean();
  for (Detail* detail : {&known.middle, &known.coarse}) detail->noise = known.fine.noise * rays / detail->rays;
}

// Derivatives of the design's fine image at the nominal pose by (pose, offsets in standard deviations), in standard
// deviations of noise.
class Sensitivity {
 public:
  Sensitivity(const Knowledge& known, Pictures& pictures) : known_(known), pictures_(pictures) {
    base_ = look(Vector::Zero(known.axes()), Vector::Zero(pictures.states()));
    weight_ = known.variance(base_, known.fine).cwiseSqrt().cwiseInverse();
  }

  Vector unweighted(const Vector& derivative) const { return derivative.cwiseQuotient(weight_); }

  // By pose and offsets.
  std::pair<Matrix, Matrix> derivatives() const {
    constexpr std::uint32_t kRays = 256;
    const Eigen::Index n = known_.axes(), count = pictures_.states();
    Detail detail = known_.fine;
    detail.rays = kRays;
    const auto found = pictures_.slopes(known_.nominal, Vector::Zero(count), detail, 0);
    if (!found) return {by_pose(), by_offsets()};
    const Matrix weighted = weight_.asDiagonal() * found->second;
    return {weighted.leftCols(n), weighted.rightCols(count)};
  }

 private:
  Matrix by_pose() const {
    const Eigen::Index n = known_.axes();
    const Matrix first = differences(Matrix::Identity(n, n), Vector::Constant(n, 0.004));
    // Repeated along the principal directions, with longer strides along insensitive ones.
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(first.transpose() * first);
    const Vector lengths =
        (30 * solver.eigenvalues().cwiseMax(1e-12).cwiseSqrt().cwiseInverse()).cwiseMax(0.003).cwiseMin(0.05);
    return differences(solver.eigenvectors(), lengths) * solver.eigenvectors().transpose();
  }

  Matrix by_offsets() const {
    const Eigen::Index count = pictures_.states();
    Matrix columns(base_.size(), count);
    for (Eigen::Index i = 0; i < count; ++i) {
      Vector state = Vector::Zero(count);
      for (const double length : {0.03, 1.0}) {
        state[i] = length;
        const Vector change = (look(Vector::Zero(known_.axes()), state) - base_).cwiseProduct(weight_);
        columns.col(i) = change / length;
        if (change.norm() > 5) break;  // otherwise numerical noise of the image may dominate
      }
    }
    return columns;
  }
  Vector look(const Vector& step, const Vector& state) const {
    return pictures_.look(known_.nominal + step, state, known_.fine);
  }
  Matrix differences(const Matrix& directions, const Vector& lengths) const {
    Matrix columns(base_.size(), directions.cols());
    const Vector none = Vector::Zero(pictures_.states());
    for (Eigen::Index i = 0; i < directions.cols(); ++i) {
      const Vector step = lengths[i] * directions.col(i);
      columns.col(i) = (look(step, none) - look(-step, none)).cwiseProduct(weight_) / (2 * lengths[i]);
    }
    return columns;
  }

  const Knowledge& known_;
  Pictures& pictures_;
  Vector base_, weight_;
};

// Keeps the `most` offsets that change a capture most.
inline void screen_offsets(Level& level, const Knowledge& known, Pictures& pictures, std::size_t most) {
  if (level.offsets.size() <= most) return;
  const Eigen::Index count = level.offset_mean.size();
  pictures.set_offsets(level.offsets, level.offset_mean, level.offset_std.asDiagonal());
  Detail quick = known.middle;
  quick.captures = 4;
  const Vector base = pictures.look(known.nominal, Vector::Zero(count), quick);
  std::vector<std::pair<double, Eigen::Index>> effects;
  for (Eigen::Index i = 0; i < count; ++i)
    effects.emplace_back(-(pictures.look(known.nominal, Vector::Unit(count, i), quick) - base).squaredNorm(), i);
  std::sort(effects.begin(), effects.end());
  std::vector<Eigen::Index> kept;
  for (std::size_t i = 0; i < most; ++i) kept.push_back(effects[i].second);
  std::sort(kept.begin(), kept.end());
  std::vector<Offset> offsets;
  for (const Eigen::Index i : kept) offsets.push_back(level.offsets[static_cast<std::size_t>(i)]);
  level.offset_mean = Vector(level.offset_mean(kept));
  level.offset_std = Vector(level.offset_std(kept));
  level.offset_correlation = Matrix(level.offset_correlation(kept, kept));
  level.offsets = std::move(offsets);
}

}  // namespace detail

struct KnowledgeSetup {
  Vector nominal;
  std::size_t most_offsets = 6;
  std::size_t far_pictures = 500;
  std::uint32_t rays = 32;
};

// Sets `pictures` to the combinations found.
inline Knowledge learn(Level level, const KnowledgeSetup& setup, Pictures& pictures) {
  constexpr std::size_t kMaxLookedAt = 12;
  Knowledge known;
  known.nominal = setup.nominal;
  const std::size_t side = std::max(pictures.size().width, pictures.size().height);
  const auto bins = [&](std::size_t count) { return std::max<std::size_t>(1, (side + count / 2) / count); };
  const std::size_t smallest = std::max<std::size_t>(1, std::min(pictures.size().width, pictures.size().height));
  known.fine.bin = std::min(bins(200), smallest);
  known.middle = {std::min(bins(50), smallest), 0.5, 2};
  known.coarse = {std::min(bins(25), smallest), 1, 2};

  pictures.set_offsets({}, Vector(), Matrix::Zero(0, 0));
  detail::learn_noise(known, pictures);
  detail::learn_picture_noise(known, setup.rays, pictures);
  detail::screen_offsets(level, known, pictures, kMaxLookedAt);
  pictures.set_offsets(level.offsets, level.offset_mean, level.offset_std.asDiagonal());
  const detail::Sensitivity sensitivity(known, pictures);
  const auto [by_pose, by_offsets] = sensitivity.derivatives();

  // An offset is observable by the image change that no move compensates; combinations are ordered by that change.
  Matrix across(by_pose.cols(), by_offsets.cols());
  const Matrix pose_squares = by_pose.transpose() * by_pose, cross = by_pose.transpose() * by_offsets;
  for (Eigen::Index i = 0; i < across.cols(); ++i) across.col(i) = detail::solve(pose_squares, cross.col(i));
  const Matrix root = detail::square_root(level.offset_correlation);
  const Matrix left = (by_offsets - by_pose * across) * root;
  Eigen::Index kept = 0;
  Matrix chosen(root.cols(), 0);
  if (left.cols() > 0) {
    const Eigen::SelfAdjointEigenSolver<Matrix> solver(left.transpose() * left);
    const Vector squares = solver.eigenvalues().reverse();
    while (kept < squares.size() && kept < static_cast<Eigen::Index>(setup.most_offsets) && squares[kept] > 1) ++kept;
    chosen = solver.eigenvectors().rowwise().reverse().leftCols(kept);
  }
  known.offsets = level.offsets;
  known.offset_mean = level.offset_mean;
  known.combinations = level.offset_std.asDiagonal() * root * chosen;
  pictures.set_offsets(known.offsets, known.offset_mean, known.combinations);

  const Eigen::Index n = known.axes();
  Matrix all(by_pose.rows(), n + kept);
  all << by_pose, by_offsets * root * chosen;
  Matrix squares = all.transpose() * all;
  squares.diagonal().head(n) += level.start_std.cwiseMax(1e-3).cwiseAbs2().cwiseInverse();
  squares.diagonal().tail(kept).array() += 1;
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(squares);
  known.directions = solver.eigenvectors();
  known.information = solver.eigenvalues().cwiseMax(1e-6);

  // Unweighted, as in the score.
  Matrix plain(all.rows(), all.cols());
  for (Eigen::Index i = 0; i < all.cols(); ++i) plain.col(i) = sensitivity.unweighted(all.col(i));
  known.optimum_by_state = Matrix::Zero(n, kept);
  const Matrix plain_pose = plain.leftCols(n);
  for (Eigen::Index i = 0; i < kept; ++i)
    known.optimum_by_state.col(i) =
        -detail::solve(plain_pose.transpose() * plain_pose, plain_pose.transpose() * plain.col(n + i));

  Detail once = known.coarse;
  once.captures = 1;
  for (std::size_t i = 0; i < std::min(setup.far_pictures, level.starts.size()); ++i) {
    known.far_poses.push_back(to_vector(level.starts[i]));
    known.far_pictures.push_back(pictures.look(known.far_poses.back(), Vector::Zero(kept), once));
  }
  known.level = std::move(level);
  return known;
}

}  // namespace tolerance_fit
