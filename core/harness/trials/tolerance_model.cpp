#include "trials/tolerance_model.h"

#include <numeric>
#include <vector>

#include "base/json_source.h"

namespace relign::trials {

Eigen::VectorXd offsets_of(const std::string& elements_json, const SceneFacts& scene) {
  Eigen::VectorXd offsets = Eigen::VectorXd::Zero(kOffsetsAnElement * static_cast<Eigen::Index>(scene.elements.size()));
  const Json given = valid_json(elements_json);
  Eigen::Index first = 0;
  for (const std::string& name : scene.elements) {
    if (const auto element = given.find(name); element != given.end()) {
      if (const auto shift = element->find("shift_mm"); shift != element->end())
        for (Eigen::Index i = 0; i < 3; ++i) offsets[first + i] = shift->at(static_cast<std::size_t>(i)).get<double>();
      if (const auto tilt = element->find("tilt_deg"); tilt != element->end())
        for (Eigen::Index i = 0; i < 2; ++i)
          offsets[first + 3 + i] = tilt->at(static_cast<std::size_t>(i)).get<double>();
    }
    first += kOffsetsAnElement;
  }
  return offsets;
}

namespace {

// From all derivatives' products: axes first, then offsets.
ToleranceModel solved(const Eigen::MatrixXd& squares, Eigen::Index axes) {
  constexpr double kNothing = 1e-6;  // of the largest eigenvalue: a motion that does not change the image
  const Eigen::Index offsets = squares.rows() - axes;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> poses(squares.topLeftCorner(axes, axes));
  const double least = kNothing * poses.eigenvalues().cwiseAbs().maxCoeff();
  const Eigen::VectorXd inverse = poses.eigenvalues().unaryExpr([&](double v) { return v > least ? 1 / v : 0.0; });
  const Eigen::MatrixXd across = squares.topRightCorner(axes, offsets);
  ToleranceModel model;
  model.at_nominal = squares.bottomRightCorner(offsets, offsets);
  model.moves = -(poses.eigenvectors() * inverse.asDiagonal() * poses.eigenvectors().transpose() * across);
  model.aligned = model.at_nominal + across.transpose() * model.moves;
  return model;
}

}  // namespace

std::optional<ToleranceModel> tolerance_model(plugin_host::MountedAssembly& design, const SceneFacts& scene,
                                              std::uint32_t samples) {
  const auto axes = static_cast<Eigen::Index>(scene.axes.size());
  const Eigen::Index all = axes + kOffsetsAnElement * static_cast<Eigen::Index>(scene.elements.size());
  const auto pixels = static_cast<Eigen::Index>(std::size_t{scene.image_width} * scene.image_height);
  std::vector<std::uint32_t> elements(scene.elements.size());
  std::iota(elements.begin(), elements.end(), 0U);
  Eigen::MatrixXf renders[2];
  Eigen::MatrixXd products[2];
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    Eigen::MatrixXf& images = renders[seed % 2];
    images.resize(pixels, 1 + all);
    if (!design.render_slopes(scene.nominal_pose, seed, samples, elements, images.data())) return std::nullopt;
    if (seed % 2 == 0) continue;
    const Eigen::MatrixXf product = renders[0].rightCols(all).transpose() * images.rightCols(all);
    products[seed / 2] = 0.5 * (product + product.transpose()).cast<double>() / static_cast<double>(pixels);
  }
  ToleranceModel model = solved(0.5 * (products[0] + products[1]), axes);
  model.error = 0.5 * (solved(products[0], axes).aligned - solved(products[1], axes).aligned);
  return model;
}

}  // namespace relign::trials
