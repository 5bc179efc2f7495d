#include "design.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sensitivity {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kFirstStride = 0.003;  // share of the travel: stride of the first, rough Jacobian
constexpr double kChange = 0.07;        // image change per stride, as a share of the reference's root mean square
constexpr double kShortest = 0.0005, kLongest = 0.04;  // strides, share of the travel
constexpr double kMotionBlur = 2;      // pixels: differences of neighbours approximate derivatives only after a blur
constexpr double kInsensitive = 3e-5;  // eigenvalues below this share of the largest are noise of the renderer
constexpr double kMinNoise = 1e-6;     // share of the reference's mean square
constexpr int kNoiseCaptures = 8;

// Central differences along the columns of `ways` (axes x ways), divided by their lengths. Returns pixels x ways.
Eigen::MatrixXf differences(const Simulator& simulator, const Vector& nominal, const Matrix& ways,
                            Eigen::Index pixels) {
  Eigen::MatrixXf changes(pixels, ways.cols());
  for (Eigen::Index k = 0; k < ways.cols(); ++k) {
    const Picture ahead = simulator.clean(nominal + ways.col(k)), behind = simulator.clean(nominal - ways.col(k));
    changes.col(k) = (ahead - behind) / static_cast<float>(2 * ways.col(k).norm());
  }
  return changes;
}

// Some directions change the image fifty times more than others, so no single stride avoids both curvature and
// rounding. Differences are therefore repeated along the principal directions of a rough Jacobian, each with a stride
// of its own.
Eigen::MatrixXf differentiate(const Simulator& simulator, const Vector& nominal, const Picture& reference) {
  const Eigen::Index n = nominal.size(), pixels = reference.size();
  const Eigen::MatrixXf rough = differences(simulator, nominal, kFirstStride * Matrix::Identity(n, n), pixels);
  const Matrix squares = (rough.transpose() * rough).cast<double>();
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(squares);
  const double wanted = kChange * static_cast<double>(reference.norm());
  Matrix ways = eigen.eigenvectors();
  for (Eigen::Index k = 0; k < n; ++k) {
    const double slope = std::sqrt(std::max(eigen.eigenvalues()[k], 0.0));
    ways.col(k) *= slope > 0 ? std::clamp(wanted / slope, kShortest, kLongest) : kLongest;
  }
  return differences(simulator, nominal, ways, pixels) * eigen.eigenvectors().transpose().cast<float>();
}

// Splits the Jacobian into a shift of the whole image and the remainder.
void split_motion(Design& design) {
  const Eigen::Index w = design.width, h = design.height;
  const Picture soft = least_squares::blurred(design.reference, w, h, kMotionBlur);
  Eigen::MatrixXf slopes = Eigen::MatrixXf::Zero(w * h, 2), changes = design.jacobian;
  for (Eigen::Index y = 1; y + 1 < h; ++y)
    for (Eigen::Index x = 1; x + 1 < w; ++x) {
      slopes(y * w + x, 0) = 0.5F * (soft[y * w + x + 1] - soft[y * w + x - 1]);
      slopes(y * w + x, 1) = 0.5F * (soft[(y + 1) * w + x] - soft[(y - 1) * w + x]);
    }
  for (Eigen::Index axis = 0; axis < design.axes(); ++axis)
    changes.col(axis) = least_squares::blurred(design.jacobian.col(axis), w, h, kMotionBlur);
  const Matrix squares = (slopes.transpose() * slopes).cast<double>(),
               products = (slopes.transpose() * changes).cast<double>();
  design.motion = -squares.completeOrthogonalDecomposition().solve(products);
  changes += slopes * design.motion.cast<float>();
  const double power = std::max(static_cast<double>(soft.squaredNorm()), 1e-30);
  design.change = (changes.transpose() * changes).cast<double>() / power;
}

}  // namespace

least_squares::Nuisance<float> disturbances(const Picture& image, const Picture& stray, Eigen::Index width,
                                            Eigen::Index height, double blur, double noise) {
  if (stray.size() == 0) return {};
  return {image, stray, {width, height}, noise * (1 + 4 * kPi * blur * blur)};
}

Level make_level(const Eigen::MatrixXf& jacobian, Eigen::Index width, Eigen::Index height, double blur,
                 const Vector& noise, least_squares::Nuisance<float> nuisance) {
  Level level;
  level.blur = blur;
  level.nuisance = std::move(nuisance);
  level.gain = jacobian;
  Matrix products(jacobian.cols(), jacobian.cols());
  for (Eigen::Index axis = 0; axis < jacobian.cols(); ++axis)
    level.gain.col(axis) = least_squares::blurred(level.nuisance.without(jacobian.col(axis)), width, height, blur);
  for (Eigen::Index axis = 0; axis < jacobian.cols(); ++axis)
    level.gain.col(axis) = level.nuisance.without(level.gain.col(axis));
  products = (jacobian.transpose() * level.gain).cast<double>();
  Matrix squares = 0.5 * (products + products.transpose());
  // White noise correlates with its own blur by the kernel's centre value.
  const double middle = blur > 0.4 ? 1 / (2 * kPi * blur * blur) : 1;
  squares.diagonal() -= middle * static_cast<double>(jacobian.rows()) * noise;
  const Eigen::SelfAdjointEigenSolver<Matrix> felt(squares);
  const Vector kept = felt.eigenvalues().cwiseMax(kInsensitive * std::max(felt.eigenvalues().maxCoeff(), 1e-20));
  level.squares = felt.eigenvectors() * kept.asDiagonal() * felt.eigenvectors().transpose();
  level.inverse = felt.eigenvectors() * kept.cwiseInverse().asDiagonal() * felt.eigenvectors().transpose();
  // Directions without any signal contribute no information, instead of infinite information.
  const Eigen::SelfAdjointEigenSolver<Matrix> noisy((level.gain.transpose() * level.gain).cast<double>());
  const double least = kInsensitive * std::max(noisy.eigenvalues().maxCoeff(), 1e-20);
  const Vector inverse = noisy.eigenvalues().unaryExpr([&](double value) { return value > least ? 1 / value : 0; });
  level.weigh = level.squares * noisy.eigenvectors() * inverse.asDiagonal() * noisy.eigenvectors().transpose();
  // Nearly insensitive directions contain noise of the renderings only; without this, poses diverge along an axis that
  // has no effect.
  const Vector real = felt.eigenvalues().unaryExpr(
      [&](double value) { return value > kInsensitive * felt.eigenvalues().maxCoeff() ? 1.0 : 0.0; });
  const Matrix only = felt.eigenvectors() * real.asDiagonal() * felt.eigenvectors().transpose();
  level.weigh = (only * level.weigh).eval();
  level.information = level.weigh * level.squares * only;
  level.information = (0.5 * (level.information + level.information.transpose())).eval();
  return level;
}

Design study(const Simulator& simulator, const Vector& nominal, const Picture& reference, Eigen::Index width,
             Eigen::Index height, double first_blur, bool stray_light) {
  Design design;
  design.nominal = nominal;
  design.reference = reference;
  design.width = width;
  design.height = height;
  design.jacobian = differentiate(simulator, nominal, reference);
  split_motion(design);
  const Picture clean = simulator.clean(nominal);
  const auto pixels = static_cast<double>(std::max<Eigen::Index>(clean.size(), 1));
  for (int k = 0; k < kNoiseCaptures; ++k) {
    const Picture noise = simulator.capture(nominal, static_cast<std::uint64_t>(k)) - clean;
    design.noise += static_cast<double>(noise.squaredNorm()) / (pixels * kNoiseCaptures);
  }
  const double power = static_cast<double>(reference.squaredNorm()) / pixels;
  design.noise = std::max({design.noise, kMinNoise * power, 1e-20});
  if (stray_light) design.stray = reference - clean;
  const Vector none = Vector::Zero(design.axes());
  const auto add_level = [&](double blur) {
    design.levels.push_back(make_level(design.jacobian, width, height, blur, none,
                                       disturbances(reference, design.stray, width, height, blur, design.noise)));
  };
  for (double blur = first_blur * static_cast<double>(std::min(width, height)); blur >= 1; blur /= 2) add_level(blur);
  add_level(0);
  return design;
}

double expected_excess(const Design& design, const Belief& best, const Vector& pose) {
  const Matrix& squares = design.levels.back().information;  // J'J: the level has no blur
  const Vector away = pose - best.mean();
  const double sum = (best.covariance() * squares).trace() + away.dot(squares * away);
  return std::sqrt(std::max(sum, 0.0) / static_cast<double>(std::max<Eigen::Index>(design.reference.size(), 1)));
}

}  // namespace sensitivity
