// A random field of stray light: Gaussian blobs, a low-order gradient, thin rings and arcs. Internal to imaging; used
// by capture_errors.cpp.
#pragma once

#include <relign/random.hpp>
#include <vector>

#include "imaging/imaging_errors.h"

namespace relign::imaging {

class StrayLight {
 public:
  StrayLight(int width, int height);

  // Draws a field, whose mean over the image is the drawn mean in units of white.
  void draw(const StrayLightErrors& errors, Random& random);
  // Row by row, in units of white.
  const std::vector<float>& field() const { return field_; }

 private:
  // Nodes of a coarse grid over the image, on which smooth light is computed; between them it is bilinear.
  static constexpr int kCells = 32, kNodes = kCells + 1;

  void add_blobs(const StrayLightErrors& errors, int count, Random& random);
  void add_gradient(double weight, Random& random);
  void interpolate();
  void add_ring(bool arc, Random& random);

  int width_, height_;
  double across_, down_;              // sides of the image, in units of the longer one
  std::vector<float> nodes_, terms_;  // kNodes x kNodes
  std::vector<float> stretched_;      // kNodes x width: nodes interpolated along rows
  std::vector<float> field_, rings_;
};

}  // namespace relign::imaging
