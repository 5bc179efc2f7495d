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

std::optional<ToleranceModel> tolerance_model(plugin_host::MountedAssembly& design, const SceneFacts& scene,
                                              std::uint32_t samples) {
  constexpr double kNothing = 1e-6;  // of the largest eigenvalue: a motion that does not change the image
  const auto axes = static_cast<Eigen::Index>(scene.axes.size());
  const Eigen::Index offsets = kOffsetsAnElement * static_cast<Eigen::Index>(scene.elements.size());
  const auto pixels = static_cast<Eigen::Index>(std::size_t{scene.image_width} * scene.image_height);
  std::vector<std::uint32_t> elements(scene.elements.size());
  std::iota(elements.begin(), elements.end(), 0U);
  Eigen::MatrixXf renders[2];
  for (std::uint64_t seed = 0; seed < 2; ++seed) {
    Eigen::MatrixXf& images = renders[seed];
    images.resize(pixels, 1 + axes + offsets);
    if (!design.render_slopes(scene.nominal_pose, seed, samples, elements, images.data())) return std::nullopt;
  }
  const Eigen::MatrixXd product =
      (renders[0].rightCols(axes + offsets).transpose() * renders[1].rightCols(axes + offsets)).cast<double>() /
      static_cast<double>(pixels);
  const Eigen::MatrixXd squares = 0.5 * (product + product.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> poses(squares.topLeftCorner(axes, axes));
  const double least = kNothing * poses.eigenvalues().cwiseAbs().maxCoeff();
  const Eigen::VectorXd inverse = poses.eigenvalues().unaryExpr([&](double v) { return v > least ? 1 / v : 0.0; });
  const Eigen::MatrixXd across = squares.topRightCorner(axes, offsets);
  const Eigen::MatrixXd compensated = poses.eigenvectors() * inverse.asDiagonal() * poses.eigenvectors().transpose();
  ToleranceModel model;
  model.at_nominal = squares.bottomRightCorner(offsets, offsets);
  model.aligned = model.at_nominal - across.transpose() * compensated * across;
  return model;
}

}  // namespace relign::trials
