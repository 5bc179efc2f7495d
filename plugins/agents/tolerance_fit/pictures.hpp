// Renders images of the model with given element offsets, and their derivatives, binned and blurred.
#pragma once

#include <algorithm>
#include <cstddef>
#include <list>
#include <nlohmann/json.hpp>
#include <optional>
#include <relign/plugin.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "level.hpp"

namespace tolerance_fit {

// Resolution and quality of images.
struct Detail {
  std::size_t bin = 1;     // side of a bin, in pixels
  double blur = 0;         // standard deviation, in bins
  int captures = 0;        // number of averaged captures; 0: noise-free
  std::uint32_t rays = 1;  // per pixel, where the model offers derivatives
  double noise = 0;        // variance of a picture, as a share of that of a capture
};

struct Size {
  std::size_t width = 0, height = 0;
  std::size_t pixels() const { return width * height; }
};

namespace detail {

inline Matrix blur_kernel(Eigen::Index count, double std) {
  Matrix kernel(count, count);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < count; ++j) {
      const double away = static_cast<double>(i - j) / std;
      kernel(i, j) = away * away > 18 ? 0 : std::exp(-0.5 * away * away);
    }
  return kernel / kernel.row(count / 2).sum();  // pixels beyond the border count as 0
}

}  // namespace detail

// Means over bins, then blurred; row by row. Incomplete bins at the right and lower border are dropped.
// Not least_squares::means_over_squares, which adds in another order: a difference in the last bit changes the result
// of a fit along insensitive directions.
template <class Number>
Vector binned(const Number* pixels, Size size, Detail detail) {
  using RowMajor = Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const RowMajor> all(pixels, static_cast<Eigen::Index>(size.height),
                                       static_cast<Eigen::Index>(size.width));
  if (detail.bin == 1 && detail.blur <= 0)
    return Eigen::Map<const Eigen::Matrix<Number, Eigen::Dynamic, 1>>(pixels, all.size()).template cast<double>();
  const auto bin = static_cast<Eigen::Index>(detail.bin);
  const Eigen::Index rows = all.rows() / bin, columns = all.cols() / bin;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> means(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index j = 0; j < columns; ++j)
      means(i, j) = static_cast<double>(all.block(i * bin, j * bin, bin, bin).mean());
  if (detail.blur > 0)
    means = detail::blur_kernel(rows, detail.blur) * means * detail::blur_kernel(columns, detail.blur).transpose();
  return Eigen::Map<const Vector>(means.data(), means.size());
}

template <class Number>
Vector binned(const std::vector<Number>& pixels, Size size, Detail detail) {
  return binned(pixels.data(), size, detail);
}

// Share of the power of white noise that remains after the blur.
inline double noise_left(Detail detail) {
  if (detail.blur <= 0) return 1;
  const Matrix kernel = detail::blur_kernel(41, detail.blur);
  const double along = kernel.row(20).squaredNorm();
  return along * along;
}

// Renders lenses that differ from the design along a few combinations of offsets; `state` has their coefficients.
class Pictures {
 public:
  static constexpr std::size_t kMaxMounted = 12;  // the host allows 16

  explicit Pictures(relign::Model model) : model_(std::move(model)), size_{model_.width(), model_.height()} {
    const auto scene = nlohmann::json::parse(model_.scene_json());
    if (const auto names = scene.find("elements"); names != scene.end())
      for (const auto& name : *names) names_.push_back(name.get<std::string>());
  }

  void set_offsets(std::vector<Offset> offsets, Vector mean, Matrix combinations) {
    lenses_.clear();
    offsets_ = std::move(offsets);
    elements_.clear();
    columns_.clear();
    for (const Offset& offset : offsets_) {
      const auto name = std::find(names_.begin(), names_.end(), offset.element);
      if (name == names_.end()) throw std::runtime_error("the scene has no element '" + offset.element + "'");
      const auto number = static_cast<std::uint32_t>(name - names_.begin());
      auto place = std::find(elements_.begin(), elements_.end(), number);
      if (place == elements_.end()) place = elements_.insert(place, number);
      columns_.push_back(5 * static_cast<std::size_t>(place - elements_.begin()) + (offset.tilt ? 3 : 0) + offset.axis);
    }
    mean_ = std::move(mean);
    combinations_ = std::move(combinations);
  }

  Size size() const { return size_; }
  Eigen::Index states() const { return combinations_.cols(); }

  // Poses are clamped to the travel.
  std::vector<float> pixels(const Vector& pose, const Vector& state, int captures) {
    const relign::ModelLens& lens = mounted(state);
    const relign::Pose at = to_pose(pose.cwiseMax(0).cwiseMin(1));
    if (captures <= 0) {
      if (auto clean = lens.noise_free(at)) return std::move(*clean);
      captures = kInsteadOfNoiseFree;
    }
    // Always the same seeds, so that noise largely cancels in differences between neighbouring poses.
    std::vector<float> sum = lens.capture(at, 1);
    for (int k = 1; k < captures; ++k) {
      const std::vector<float> more = lens.capture(at, static_cast<std::uint64_t>(k) + 1);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += more[i];
    }
    for (float& pixel : sum) pixel /= static_cast<float>(captures);
    return sum;
  }

  Vector look(const Vector& pose, const Vector& state, Detail detail) {
    return binned(pixels(pose, state, detail.captures), size_, detail);
  }

  // A picture and its derivatives by (pose, state), from detail.rays rays per pixel. Nothing where the model has none.
  std::optional<std::pair<Vector, Matrix>> slopes(const Vector& pose, const Vector& state, Detail detail,
                                                  std::uint64_t seed) {
    if (!has_slopes_) return std::nullopt;
    const relign::Pose at = to_pose(pose.cwiseMax(0).cwiseMin(1));
    const auto images = mounted(state).slopes(at, seed, detail.rays, elements_);
    has_slopes_ = images.has_value();
    if (!images) return std::nullopt;
    const auto image = [&](std::size_t number) { return binned(&(*images)[number * size_.pixels()], size_, detail); };
    const Vector picture = image(0);
    Matrix by_offset(picture.size(), columns_.size());
    for (std::size_t i = 0; i < columns_.size(); ++i)
      by_offset.col(static_cast<Eigen::Index>(i)) = image(1 + at.size() + columns_[i]);
    Matrix slopes(picture.size(), pose.size() + states());
    for (Eigen::Index axis = 0; axis < pose.size(); ++axis)
      slopes.col(axis) = image(1 + static_cast<std::size_t>(axis));
    if (states() > 0) slopes.rightCols(states()) = by_offset * combinations_;
    return std::pair{picture, slopes};
  }

 private:
  static constexpr int kInsteadOfNoiseFree = 32;

  const relign::ModelLens& mounted(const Vector& state) {
    for (auto lens = lenses_.begin(); lens != lenses_.end(); ++lens)
      if (lens->first == state) {
        lenses_.splice(lenses_.begin(), lenses_, lens);
        return lenses_.front().second;
      }
    if (lenses_.size() >= kMaxMounted) lenses_.pop_back();
    const Vector values = combinations_.cols() > 0 ? Vector(mean_ + combinations_ * state) : mean_;
    lenses_.emplace_front(state, model_.mount(offsets_json(offsets_, values)));
    return lenses_.front().second;
  }

  relign::Model model_;
  Size size_;
  bool has_slopes_ = true;          // until the model refuses
  std::vector<std::string> names_;  // of the scene's elements
  std::vector<Offset> offsets_;
  std::vector<std::uint32_t> elements_;  // that have offsets
  std::vector<std::size_t> columns_;     // of each offset, among the derivatives of these elements
  Vector mean_;
  Matrix combinations_;
  std::list<std::pair<Vector, relign::ModelLens>> lenses_;  // most recently used first
};

}  // namespace tolerance_fit
