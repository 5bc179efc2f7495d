#include "imaging/diffracted_mse.h"

namespace relign::imaging {

DiffractedMse::DiffractedMse(const Diffraction& diffraction, int width, int height)
    : diffraction_(&diffraction),
      width_(width),
      height_(height),
      overlap_(diffraction.overlap()),
      rows_(static_cast<std::size_t>(height)) {
  for (Images* images : {&groups_, &blurred_, &twice_})
    for (std::vector<float>& image : *images)
      image.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
}

MseEstimate DiffractedMse::estimate(const Reference& reference, Parallel& parallel) {
  constexpr int groups = kMseGroups;
  static_assert(groups == 4, "pairs of groups are paired off below");
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    diffraction_->blur(groups_[g].data(), blurred_[g].data(), parallel, work_);
    for (std::size_t at = 0; at < blurred_[g].size(); ++at)
      twice_[g][at] = 2 * blurred_[g][at] - reference.first[at] - reference.second[at];
    diffraction_->blur(twice_[g].data(), twice_[g].data(), parallel, work_);
  }
  parallel.for_each(height_, [&](int row, unsigned) {
    MseSum sum;
    for (int column = 0; column < width_; ++column) {
      const auto at = static_cast<std::size_t>(row * width_ + column);
      const double o1 = static_cast<double>(reference.first[at]), o2 = static_cast<double>(reference.second[at]);
      double values[kMseGroups];
      for (std::size_t g = 0; g < blurred_.size(); ++g) values[g] = static_cast<double>(blurred_[g][at]);
      sum.product += product_of_pixel(values, o1, o2);
      // As without diffraction (mse_pixel.h), for the pixels before the blur, which vary independently: a pixel
      // affects the mean in proportion to the blurred differences from the references around it, and its square in
      // proportion to the autocorrelation of the kernel.
      constexpr int pairings[3][4] = {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}};
      double linear = 0, square = 0;
      for (const auto& [i, j, k, l] : pairings) {
        const auto value = [at](const Images& images, int m) {
          return static_cast<double>(images[static_cast<std::size_t>(m)][at]);
        };
        const auto both = [&](int m, int n) { return value(twice_, m) * value(twice_, n); };
        const auto scatter = [&](int m, int n) {
          const double difference = value(groups_, m) - value(groups_, n);
          return 0.5 * difference * difference;
        };
        const double one = scatter(i, j), other = scatter(k, l);
        linear += (both(i, j) * other + both(k, l) * one) / 6;
        square += one * other / 3;
      }
      sum.variance += linear / groups + 2 * overlap_ * square / (groups * (groups - 1));
    }
    rows_[static_cast<std::size_t>(row)] = sum;
  });
  MseSum all;
  for (const MseSum& sum : rows_) all += sum;
  return estimate_of(all, static_cast<double>(width_) * static_cast<double>(height_));
}

}  // namespace relign::imaging
