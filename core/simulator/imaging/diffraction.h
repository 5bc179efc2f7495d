// Diffraction in images ("diffraction" of a scene file): the image of rays is convolved with the point spread function
// of the pupil's shape, so that its MTF is about the geometric MTF times that of a perfect lens with the same pupil.
//
// At kZones x kZones places of the sensor the shape of the pupil is traced (perfect lens, nominal pose; vignetting and
// obliquity included), and its diffraction-limited transfer is the autocorrelation of that shape. A kernel of (2 R +
// 1)^2 pixels has exactly this transfer at (2 R + 1)^2 frequencies, so that its sum is 1 and light spread beyond R
// pixels is kept; R is the smallest radius that is accurate at other frequencies too. Kernels are blended between
// zones. With several wavelengths each zone has one kernel, their mean by weight and light. Outside its borders the
// image is continued by reflection.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "imaging/scene_file.h"

namespace relign::imaging {

class Diffraction {
 public:
  explicit Diffraction(const SceneFile& scene);

  // Buffers of blur(); keep them between calls, so that it does not allocate from the second on.
  using Workspace = std::vector<float>;
  // Both have sensor.pixels() values and may be the same buffer. Same bits for any number of threads.
  void blur(const float* image, float* blurred, Parallel& parallel, Workspace& work) const;

  int radius() const { return radius_; }  // R
  // Sum of squares of the autocorrelation of the middle zone's kernel: the factor by which a blur reduces the variance
  // of sums of squares of independent noise.
  double overlap() const;
  // For tests: transfer of the kernel at a position (pixels) for frequencies in cycles per pixel.
  double transfer(double column, double row, double cycles_x, double cycles_y) const;

 private:
  struct Shape;
  struct Shapes;
  using Kernel = std::vector<double>;  // row by row
  Kernel blended(double column, double row) const;
  void blend(double column, double row, float* kernel) const;

  static constexpr int kZones = 5;
  static constexpr int kMaxRadius = 12;
  int width_, height_;
  int radius_ = 0;
  std::vector<Kernel> kernels_;  // of the zones, row by row; the outer ones are on the image's border
};

}  // namespace relign::imaging
