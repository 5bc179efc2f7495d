#include "imaging/stray_light.h"

#include <algorithm>
#include <cmath>

#include "optics/elementary.h"

namespace relign::imaging {
namespace {

constexpr double kMostOutside = 0.2;  // of the image's side, for centres of blobs

double sum_of(const std::vector<float>& values) {
  double sum = 0;
  for (const float value : values) sum += static_cast<double>(value);
  return sum;
}

double mean_of(const std::vector<float>& values) { return sum_of(values) / static_cast<double>(values.size()); }

}  // namespace

StrayLight::StrayLight(int width, int height)
    : width_(width),
      across_(static_cast<double>(width) / std::max(width, height)),
      down_(static_cast<double>(height) / std::max(width, height)),
      nodes_(kStrayNodes * kStrayNodes),
      terms_(nodes_.size()) {
  rings_.reserve(32);  // the most that a file can ask for
}

void StrayLight::draw(const StrayLightErrors& errors, Random& random) {
  levels_.mean = errors.mean.draw(random);
  const double gradient = errors.gradient.draw(random);
  const int blobs = errors.blobs.draw_integer(random), rings = errors.rings.draw_integer(random);
  const int arcs = errors.arcs.draw_integer(random);
  levels_.ring_share = errors.ring_share.draw(random);
  std::fill(nodes_.begin(), nodes_.end(), 0.0F);
  add_blobs(errors, blobs, random);
  if (blobs == 0 && gradient == 0) std::fill(nodes_.begin(), nodes_.end(), 1.0F);
  if (gradient > 0) add_gradient(blobs == 0 ? 1 : gradient, random);
  rings_.clear();
  for (int i = 0; i < rings + arcs; ++i) add_ring(i >= rings, random);
}

// Elliptical, of random direction and relative strength; together their mean over the nodes is 1.
void StrayLight::add_blobs(const StrayLightErrors& errors, int count, Random& random) {
  if (count == 0) return;
  for (int blob = 0; blob < count; ++blob) {
    const double x = across_ * random.uniform(-kMostOutside, 1 + kMostOutside);
    const double y = down_ * random.uniform(-kMostOutside, 1 + kMostOutside);
    const double longer = errors.blob_radius.draw(random), shorter = longer * random.uniform(0.4, 1);
    const optics::SineCosine turn = optics::sine_cosine_of_degrees(random.uniform(0, 180));
    const auto strength = static_cast<float>(random.uniform(0.2, 1));
    constexpr double kHalfLog2 = 0.72134752044448170;  // exp(-r^2 / 2) = 2^(-kHalfLog2 r^2)
    const double scale = std::sqrt(kHalfLog2);
    const auto ax = static_cast<float>(scale * turn.cosine / longer),
               ay = static_cast<float>(scale * turn.sine / longer);
    const auto bx = static_cast<float>(-scale * turn.sine / shorter);
    const auto by = static_cast<float>(scale * turn.cosine / shorter);
    const auto step_x = static_cast<float>(across_ / kStrayCells);
    for (int row = 0; row < kStrayNodes; ++row) {
      const auto dy = static_cast<float>(down_ * row / kStrayCells - y);
      const auto left = static_cast<float>(-x);
      float* const nodes = nodes_.data() + row * kStrayNodes;
      for (int column = 0; column < kStrayNodes; ++column) {
        const float dx = left + step_x * static_cast<float>(column);
        const float a = ax * dx + ay * dy, b = bx * dx + by * dy;
        nodes[column] += strength * exp2_of(-(a * a + b * b));
      }
    }
  }
  const auto scale = static_cast<float>(1 / mean_of(nodes_));
  for (float& node : nodes_) node *= scale;
}

// a x + b y + c x^2 + d x y + e y^2 over -1..1 with random coefficients, raised to a minimum of 0 and scaled to a mean
// of `weight`.
void StrayLight::add_gradient(double weight, Random& random) {
  float c[5];
  for (float& coefficient : c) coefficient = static_cast<float>(random.uniform(-1, 1));
  for (int row = 0; row < kStrayNodes; ++row)
    for (int column = 0; column < kStrayNodes; ++column) {
      const float x = static_cast<float>(2 * column - kStrayCells) / kStrayCells;
      const float y = static_cast<float>(2 * row - kStrayCells) / kStrayCells;
      terms_[static_cast<std::size_t>(row * kStrayNodes + column)] =
          c[0] * x + c[1] * y + c[2] * x * x + c[3] * x * y + c[4] * y * y;
    }
  const float lowest = *std::min_element(terms_.begin(), terms_.end());
  for (float& term : terms_) term -= lowest;
  const double mean = mean_of(terms_);
  const auto scale = static_cast<float>(mean > 0 ? weight / mean : 0);
  for (std::size_t i = 0; i < nodes_.size(); ++i) nodes_[i] += scale * terms_[i];
}

void StrayLight::add_ring(bool arc, Random& random) {
  const double x = across_ * random.uniform(-0.1, 1.1), y = down_ * random.uniform(-0.1, 1.1);
  const double radius = random.uniform(0.1, 0.7), half_width = random.uniform(0.01, 0.04);
  const optics::SineCosine middle = optics::sine_cosine_of_degrees(random.uniform(0, 360));
  const optics::SineCosine half_angle = optics::sine_cosine_of_degrees(random.uniform(10, 60));
  const double strength = random.uniform(0.2, 1);
  Ring ring{};
  ring.pitch = across_ / width_;
  ring.y = y;
  ring.left = static_cast<float>(0.5 * ring.pitch - x);
  ring.step = static_cast<float>(ring.pitch);
  ring.radius2 = static_cast<float>(radius * radius);
  ring.per_width = static_cast<float>(0.5 / (radius * half_width));
  // A full ring is an arc that no angle excludes.
  ring.start = static_cast<float>(arc ? -8 * half_angle.cosine : 1);
  ring.fade = static_cast<float>(arc ? 8 / radius : 0);
  ring.along_x = static_cast<float>(middle.cosine);
  ring.along_y = static_cast<float>(middle.sine);
  ring.bright = static_cast<float>(strength);
  ring.reach = radius + 2 * half_width;
  rings_.push_back(ring);
}

StrayLightField::StrayLightField(int width, int height)
    : width_(width),
      height_(height),
      stretched_(static_cast<std::size_t>(kStrayNodes) * static_cast<std::size_t>(width)),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
      rings_(pixels_.size()) {}

void StrayLightField::render(const StrayLight& light) {
  interpolate(light.nodes());
  std::fill(rings_.begin(), rings_.end(), 0.0F);
  for (const Ring& ring : light.rings()) add_ring(ring);
  const StrayFactors factors = stray_factors(
      light.levels(), sum_of(pixels_), light.rings().empty() ? 0 : sum_of(rings_), static_cast<double>(pixels_.size()));
  for (std::size_t i = 0; i < pixels_.size(); ++i) pixels_[i] = stray_light(factors, pixels_[i], rings_[i]);
}

void StrayLightField::interpolate(const std::vector<float>& nodes) {
  const auto width = static_cast<std::size_t>(width_);
  for (int column = 0; column < width_; ++column) {
    const GridPlace place = place_in_grid(column, width_);
    for (std::size_t row = 0; row < kStrayNodes; ++row) {
      const float* const node = nodes.data() + row * kStrayNodes + static_cast<std::size_t>(place.cell);
      stretched_[row * width + static_cast<std::size_t>(column)] = between(node[0], node[1], place.share);
    }
  }
  for (int row = 0; row < height_; ++row) {
    const GridPlace place = place_in_grid(row, height_);
    const float* const above = stretched_.data() + static_cast<std::size_t>(place.cell) * width;
    const float* const below = above + width;
    float* const out = pixels_.data() + static_cast<std::size_t>(row) * width;
    for (std::size_t column = 0; column < width; ++column)
      out[column] = between(above[column], below[column], place.share);
  }
}

void StrayLightField::add_ring(const Ring& ring) {
  const Ring here = ring;
  for (int row = 0; row < height_; ++row) {
    const double y = ring_y(here, row);
    if (std::fabs(y) > here.reach) continue;
    float* const out = rings_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
    for (int column = 0; column < width_; ++column) out[column] += ring_light(here, static_cast<float>(y), column);
  }
}

}  // namespace relign::imaging
