// Truth of a scene with diffraction: products of independent renders that were blurred each by itself, which keeps the
// estimate unbiased, since a blur is linear.
#pragma once

#include <array>
#include <vector>

#include "imaging/camera.h"
#include "imaging/diffraction.h"

namespace relign::imaging {

class DiffractedTruth {
 public:
  // `diffraction` outlives it. pixels: of an image.
  DiffractedTruth(const Diffraction& diffraction, int width, int height);

  // Where the render of a group goes, by rays alone; all before estimate().
  float* group(int number) { return groups_[static_cast<std::size_t>(number)].data(); }
  // The reference is of the same scene, blurred already.
  MseEstimate estimate(const Reference& reference, Parallel& parallel);

 private:
  using Images = std::array<std::vector<float>, kTruthGroups>;
  const Diffraction* diffraction_;
  int width_, height_;
  double overlap_;
  Images groups_, blurred_, twice_;
  Diffraction::Workspace work_;
  struct RowSum {
    double product = 0, variance = 0;
  };
  std::vector<RowSum> rows_;
};

}  // namespace relign::imaging
