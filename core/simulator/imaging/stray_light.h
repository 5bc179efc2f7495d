// A random field of stray light: Gaussian blobs, a low-order gradient, thin rings and arcs. Internal to imaging.
#pragma once

#include <relign/random.hpp>
#include <vector>

#include "imaging/imaging_errors.h"
#include "imaging/pixel_steps.h"

namespace relign::imaging {

// What is drawn of it: smooth light at the nodes of a grid, and rings.
class StrayLight {
 public:
  StrayLight(int width, int height);

  // Draws a field, whose mean over the image is the drawn mean in units of white.
  void draw(const StrayLightErrors& errors, Random& random);

  const StrayLevels& levels() const { return levels_; }
  const std::vector<float>& nodes() const { return nodes_; }  // kStrayNodes x kStrayNodes
  const std::vector<Ring>& rings() const { return rings_; }

 private:
  void add_blobs(const StrayLightErrors& errors, int count, Random& random);
  void add_gradient(double weight, Random& random);
  void add_ring(bool arc, Random& random);

  int width_;
  double across_, down_;  // sides of the image, in units of the longer one
  StrayLevels levels_{};
  std::vector<float> nodes_, terms_;
  std::vector<Ring> rings_;
};

// Its pixels.
class StrayLightField {
 public:
  StrayLightField(int width, int height);

  void render(const StrayLight& light);
  // Row by row, in units of white.
  const std::vector<float>& pixels() const { return pixels_; }

 private:
  void interpolate(const std::vector<float>& nodes);
  void add_ring(const Ring& ring);

  int width_, height_;
  std::vector<float> stretched_;  // kStrayNodes x width: nodes interpolated along rows
  std::vector<float> pixels_, rings_;
};

}  // namespace relign::imaging
