#include "registration.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sensitivity {
namespace {

// Largest relative change of the image (Design::changed) for which the Jacobian at the nominal pose is used.
constexpr double kNear = 0.25;
constexpr Eigen::Index kFinestBin = 2;  // of Jacobians far from the nominal pose: finer ones need too many captures
constexpr Eigen::Index kGoodBin = 4;    // fine enough to end a registration whose pose will move anyway
constexpr Eigen::Index kMinBins = 10;
constexpr double kBinBlur = 1.25;       // in bins
constexpr double kLongestShift = 0.15;  // share of the travel: stride of differences
constexpr double kStride = 0.7;         // image shift of a stride, as a share of the blur

// Up to this image shift in pixels and relative change of the image, the Jacobian predicts it to less than the noise.
constexpr double kLinearShift = 0.5, kLinearChange = 0.1;

constexpr double kFinestBlur = 0.5;  // pixels: counts as the blur of the level without blur
constexpr double kFarthest = 0.5;    // share of the travel: longest step
constexpr double kTrust = 1.5;       // largest image shift of a step, in units of the blur
constexpr double kShifted = 0.05;    // pixels: smaller shifts are not interpolated
constexpr double kSettled = 0.3;     // a step has converged if its image shift is below this share of the blur
constexpr double kStill = 0.02;      // share of the travel
constexpr int kMaxAtOneLevel = 3;

// Nonlinearity: a step that shifts the image by the width of the blur changes it by this share otherwise than the
// Jacobian predicts, in an unknown direction. Without this term the fit attributes large shifts to defocus.
constexpr double kBend = 0.3;
// Share of the squared residual above the noise that any one direction may explain by mistake.
constexpr double kExcess = 0.005;
constexpr double kFits = 1.02;    // misfits up to here are explained by noise
constexpr double kMinLeft = 0.3;  // lower limit of the noise as a share of the nominal image's, for dark images

// Standard deviation of the image's position in pixels, both directions together.
double pixels_off(const Design& design, const Matrix& covariance) {
  return std::sqrt(std::max((design.motion * covariance * design.motion.transpose()).trace(), 0.0));
}

// The finest level whose blur is wider than the uncertainty of the image's position.
std::size_t level_for(const Design& design, double pixels) {
  for (std::size_t level = design.levels.size(); level-- > 1;)
    if (std::max(design.levels[level].blur, kFinestBlur) >= pixels) return level;
  return 0;
}

// The design's stray light at a displacement from the nominal pose: it moves with the image. Empty like the design's.
Picture stray_at(const Design& design, const Vector& away) {
  if (design.stray.size() == 0) return {};
  const Eigen::Vector2d go = design.motion * away;
  return go.norm() > kShifted ? shifted(design.stray, design.width, design.height, -go.x(), -go.y()) : design.stray;
}

double span(const Level& level) { return std::max(level.blur, kFinestBlur); }

}  // namespace

Picture shifted(const Picture& picture, Eigen::Index width, Eigen::Index height, double right, double down) {
  Picture out = Picture::Zero(picture.size());
  if (!(std::fabs(right) < static_cast<double>(width) && std::fabs(down) < static_cast<double>(height))) return out;
  const auto whole_x = static_cast<Eigen::Index>(std::floor(right)),
             whole_y = static_cast<Eigen::Index>(std::floor(down));
  const auto share_x = static_cast<float>(right - static_cast<double>(whole_x)),
             share_y = static_cast<float>(down - static_cast<double>(whole_y));
  for (Eigen::Index dy = 0; dy < 2; ++dy)
    for (Eigen::Index dx = 0; dx < 2; ++dx) {
      const float weight = (dx == 1 ? share_x : 1 - share_x) * (dy == 1 ? share_y : 1 - share_y);
      const Eigen::Index by_x = whole_x + dx, by_y = whole_y + dy;
      const Eigen::Index first = std::max<Eigen::Index>(0, -by_x), count = width - std::abs(by_x);
      if (weight == 0 || count <= 0) continue;
      for (Eigen::Index y = std::max<Eigen::Index>(0, -by_y); y < std::min(height, height - by_y); ++y)
        out.segment(y * width + first, count) += weight * picture.segment((y + by_y) * width + first + by_x, count);
    }
  return out;
}

Level Registration::linearise(const Vector& away, double blur) const {
  const Eigen::Index n = away.size();
  Eigen::Index bin = kFinestBin;
  while (1.5 * kBinBlur * static_cast<double>(bin) < blur &&
         2 * bin * kMinBins <= std::min(design.width, design.height))
    bin *= 2;
  const Eigen::Index columns = design.width / bin, rows = design.height / bin;
  const int each = std::max(1, captures / static_cast<int>(2 * bin));
  // Along the directions that shift the image and across them, each with a stride that suits the blur.
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(design.motion.transpose() * design.motion);
  Eigen::MatrixXf changes(columns * rows, n);
  Matrix ways(n, n);
  Picture middle;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double moves = std::sqrt(std::max(eigen.eigenvalues()[k], 1e-12));
    const double stride = std::min(kLongestShift, kStride * kBinBlur * static_cast<double>(bin) / moves);
    Vector ahead = away + stride * eigen.eigenvectors().col(k), behind = away - stride * eigen.eigenvectors().col(k);
    const Picture one = render(ahead, each).mean, other = render(behind, each).mean;
    ways.col(k) = ahead - behind;
    if (k == 0) middle = 0.5F * (one + other);  // along the direction of the smallest shift
    changes.col(k) = least_squares::means_over_squares(one - other, design.width, design.height, bin);
  }
  const Matrix back = ways.completeOrthogonalDecomposition().pseudoInverse();
  const double noise = 2 * design.noise / static_cast<double>(each * bin * bin);
  const auto binned = [&](const Picture& all) {
    return least_squares::means_over_squares(all, design.width, design.height, bin);
  };
  const double wide = kBinBlur * static_cast<double>(bin);
  const Picture stray = stray_at(design, away);
  auto nuisance = disturbances(binned(middle), stray.size() > 0 ? binned(stray) : stray, columns, rows, wide,
                               design.noise / static_cast<double>(bin * bin));
  Level level = make_level(changes * back.cast<float>(), columns, rows, kBinBlur,
                           noise * back.colwise().squaredNorm().transpose(), std::move(nuisance));
  level.bin = bin;
  level.blur *= static_cast<double>(bin);
  return level;
}

Estimate Registration::compare(const Picture& capture, const Belief& before, const Vector& away, const Level& level,
                               bool far, bool finest) const {
  Estimate estimate;
  const bool at_reference =
      use_reference && finest && (design.motion * away).norm() < kLinearShift && design.changed(away) < kLinearChange;
  const bool renders = render && !at_reference;
  estimate.linearised = renders ? away : Vector::Zero(away.size());
  const int many = std::max(2, finest ? captures : captures / 4);
  const Rendering shown = renders ? render(estimate.linearised, many) : Rendering{design.reference, design.noise};
  Picture residual = capture - shown.mean;
  if (renders && design.stray.size() > 0) residual -= stray_at(design, estimate.linearised);
  const auto pixels = static_cast<double>(std::max<Eigen::Index>(residual.size(), 1));
  const auto power = static_cast<double>(residual.squaredNorm());
  if (far) {
    residual = least_squares::means_over_squares(residual, design.width, design.height, level.bin);
  } else {
    // The Jacobian was taken at the nominal pose: shift the residual to where the image would be there.
    const Eigen::Vector2d go = design.motion * estimate.linearised;
    if (go.norm() > kShifted) residual = shifted(residual, design.width, design.height, go.x(), go.y());
  }
  const auto binned = static_cast<double>(level.bin * level.bin);
  const double least = kMinLeft * design.noise;
  const least_squares::Nuisance<float>::Fit fit = level.nuisance.fit(residual);
  const double left = std::max((power - binned * fit.explained) / pixels, least);
  // The variance of photon noise is proportional to the gain, that of an amplified image to its square.
  const double noise = std::max(shown.noise * std::pow(std::clamp(fit.gain, 0.5, 2.0), 1.5), least);
  const double unavoidable = renders ? noise + std::max(shown.noise, least) / many : noise;
  estimate.misfit = left / unavoidable;
  const Vector projected = (level.gain.transpose() * residual).cast<double>();
  Belief plain{level.information * (binned / left), level.weigh * projected * (binned / left)};
  plain.weighed += plain.information * estimate.linearised;

  const Vector step = before.with(plain).mean() - away;
  const double bent = kBend * (design.motion * step).norm() / span(level);
  const double excess = kExcess * std::max(left - kFits * unavoidable, 0.0) * pixels / binned;
  estimate.away = plain.inflated((bent * bent * step.dot(level.squares * step) + excess) * level.inverse);
  if (!estimate.away.finite()) estimate.away = Belief::nothing(away.size());
  return estimate;
}

Estimate Registration::operator()(const Picture& capture, const Belief& before, int most_comparisons) const {
  Estimate best;
  Vector away = before.mean();
  std::size_t level = render ? level_for(design, pixels_off(design, before.covariance())) : 0;
  Vector best_end = away;  // result of the best comparison
  bool astray = false;     // a step with the Jacobian of the nominal pose made the fit worse: do not use it any more
  for (int made = 0, tries = 0; made < most_comparisons; ++made) {
    const bool far = render && (astray || design.changed(away) > kNear);
    const bool finest = !far && level + 1 == design.levels.size();
    Level fresh;
    if (far) fresh = linearise(away, design.levels[level].blur);
    const Level& here = far ? fresh : design.levels[level];
    Estimate estimate = compare(capture, before, away, here, far, finest);

    const Belief after = before.with(estimate.away);
    Vector step = after.mean() - away;
    if (!step.allFinite()) step.setZero();
    step *= std::min(1.0, kFarthest / std::max(step.norm(), 1e-12));
    if (render) step *= std::min(1.0, kTrust * span(here) / std::max((design.motion * step).norm(), 1e-12));
    away += step;
    // With one Jacobian for all poses the displacement itself counts, not the last step.
    estimate.moved = (design.motion * (render ? step : away)).norm();
    estimate.step = step.norm();
    if (made == 0 || estimate.misfit < best.misfit + kWorse) {
      best = estimate;
      best_end = away;
    } else if (render && !astray) {
      astray = true;
      away = best_end;
      continue;
    }

    const std::size_t next = level_for(design, pixels_off(design, after.covariance()) + (render ? 0 : estimate.moved));
    const bool settled = estimate.moved < kSettled * span(here), fits = estimate.misfit < kFits;
    const bool still = settled && estimate.step < kStill;
    if (finest && settled && (fits || still)) break;
    if (far && here.bin <= kGoodBin && estimate.moved < here.blur && (fits || (still && here.bin == kFinestBin))) break;
    if (!render && next <= level) break;
    if (next > level || settled || ++tries >= kMaxAtOneLevel) {
      level = std::min(level + 1, design.levels.size() - 1);
      tries = 0;
    }
  }
  return best;
}

}  // namespace sensitivity
