// Diffraction in images ("diffraction" of a scene file): a finished image of rays is convolved with the point spread of
// the pupil's shape, so that what lines keep is about what they keep by geometry times what a perfect lens with that
// pupil leaves of them.
//
// At kZones x kZones places of the sensor the shape of the pupil is traced (perfect lens, nominal pose; vignetting and
// obliquity included), and its diffraction-limited transfer is the autocorrelation of that shape. A kernel of
// (2 R + 1)^2 pixels has exactly this transfer at (2 R + 1)^2 frequencies, so that its sum is 1 and what the point
// spread has beyond R pixels is not lost; R is the smallest that keeps other frequencies close, too. Kernels are
// blended between zones. Of several wavelengths, each zone has one kernel: the mean of theirs by weight and light. The
// light outside the image is taken for its mirror image.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "imaging/scene_file.h"

namespace relign::imaging {

class Diffraction {
 public:
  explicit Diffraction(const SceneFile& scene);

  // What a call needs, to be kept between calls: nothing is allocated from the second on.
  using Workspace = std::vector<float>;
  // Both have sensor.pixels() values and may be the same. Bit-equal for any number of threads.
  void blur(const float* image, float* blurred, Parallel& parallel, Workspace& work) const;

  int radius() const { return radius_; }  // R
  // Sum of squares of the autocorrelation of the middle zone's kernel: how much less independent noise varies in
  // sums of squares after a blur.
  double overlap() const;
  // Of the kernel at a place (in pixels), for tests: what waves of so many cycles a pixel keep.
  double transfer(double column, double row, double cycles_x, double cycles_y) const;

 private:
  struct Shape;
  struct Shapes;
  using Kernel = std::vector<double>;  // row by row
  Kernel blended(double column, double row) const;
  void blend(double column, double row, float* kernel) const;

  static constexpr int kZones = 5;
  static constexpr int kMostRadius = 12;
  int width_, height_;
  int radius_ = 0;
  std::vector<Kernel> kernels_;  // of the zones, row by row; the outer ones lie on the image's rim
};

}  // namespace relign::imaging
