// Noise-free MSE of scenes with diffraction: products of independent renders, each blurred separately, which keeps the
// estimate unbiased because blurring is linear.
#pragma once

#include <array>
#include <vector>

#include "imaging/camera.h"
#include "imaging/diffraction.h"

namespace relign::imaging {

class DiffractedMse {
 public:
  // `diffraction` must outlive it. width, height: of an image, pixels.
  DiffractedMse(const Diffraction& diffraction, int width, int height);

  // Buffer for the render of a group, without diffraction. Fill all groups before estimate().
  float* group(int number) { return groups_[static_cast<std::size_t>(number)].data(); }
  // The reference is of the same scene and already blurred.
  MseEstimate estimate(const Reference& reference, Parallel& parallel);

 private:
  using Images = std::array<std::vector<float>, kMseGroups>;
  const Diffraction* diffraction_;
  int width_, height_;
  double overlap_;
  Images groups_, blurred_, twice_;
  Diffraction::Workspace work_;
  std::vector<MseSum> rows_;
};

}  // namespace relign::imaging
