#include "imaging/stray_light.h"

#include <algorithm>
#include <cmath>

#include "imaging/error_math.h"
#include "optics/elementary.h"

namespace relign::imaging {
namespace {

constexpr double kMostOutside = 0.2;  // of the image's side, for centres of blobs

double mean_of(const std::vector<float>& values) {
  double sum = 0;
  for (const float value : values) sum += static_cast<double>(value);
  return sum / static_cast<double>(values.size());
}

}  // namespace

StrayLight::StrayLight(int width, int height)
    : width_(width),
      height_(height),
      across_(static_cast<double>(width) / std::max(width, height)),
      down_(static_cast<double>(height) / std::max(width, height)),
      nodes_(kNodes * kNodes),
      terms_(kNodes * kNodes),
      stretched_(static_cast<std::size_t>(kNodes) * static_cast<std::size_t>(width)),
      field_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
      rings_(field_.size()) {}

void StrayLight::draw(const StrayLightErrors& errors, Random& random) {
  const double mean = errors.mean.draw(random), gradient = errors.gradient.draw(random);
  const int blobs = errors.blobs.draw_integer(random), rings = errors.rings.draw_integer(random);
  const int arcs = errors.arcs.draw_integer(random);
  const double share = errors.ring_share.draw(random);
  std::fill(nodes_.begin(), nodes_.end(), 0.0F);
  add_blobs(errors, blobs, random);
  if (blobs == 0 && gradient == 0) std::fill(nodes_.begin(), nodes_.end(), 1.0F);
  if (gradient > 0) add_gradient(blobs == 0 ? 1 : gradient, random);
  interpolate();
  std::fill(rings_.begin(), rings_.end(), 0.0F);
  for (int i = 0; i < rings + arcs; ++i) add_ring(i >= rings, random);
  const double smooth = mean_of(field_), thin = rings + arcs > 0 ? mean_of(rings_) : 0;
  // Where no ring crosses the image, all stray light is smooth.
  const double of_rings = thin > 0 ? share : 0;
  const auto a = static_cast<float>(mean * (1 - of_rings) / smooth);
  const auto b = static_cast<float>(thin > 0 ? mean * of_rings / thin : 0);
  for (std::size_t i = 0; i < field_.size(); ++i) field_[i] = a * field_[i] + b * rings_[i];
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
    const auto step_x = static_cast<float>(across_ / kCells);
    for (int row = 0; row < kNodes; ++row) {
      const auto dy = static_cast<float>(down_ * row / kCells - y);
      const auto left = static_cast<float>(-x);
      float* const nodes = nodes_.data() + row * kNodes;
      for (int column = 0; column < kNodes; ++column) {
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
  for (int row = 0; row < kNodes; ++row)
    for (int column = 0; column < kNodes; ++column) {
      const float x = static_cast<float>(2 * column - kCells) / kCells;
      const float y = static_cast<float>(2 * row - kCells) / kCells;
      terms_[static_cast<std::size_t>(row * kNodes + column)] =
          c[0] * x + c[1] * y + c[2] * x * x + c[3] * x * y + c[4] * y * y;
    }
  const float lowest = *std::min_element(terms_.begin(), terms_.end());
  for (float& term : terms_) term -= lowest;
  const double mean = mean_of(terms_);
  const auto scale = static_cast<float>(mean > 0 ? weight / mean : 0);
  for (std::size_t i = 0; i < nodes_.size(); ++i) nodes_[i] += scale * terms_[i];
}

void StrayLight::interpolate() {
  const auto width = static_cast<std::size_t>(width_);
  for (std::size_t column = 0; column < width; ++column) {
    const double at = (static_cast<double>(column) + 0.5) * kCells / width_;
    const auto cell = static_cast<std::size_t>(at);
    const auto share = static_cast<float>(at - static_cast<double>(cell));
    for (std::size_t row = 0; row < kNodes; ++row) {
      const float* const node = nodes_.data() + row * kNodes + cell;
      stretched_[row * width + column] = node[0] + share * (node[1] - node[0]);
    }
  }
  for (int row = 0; row < height_; ++row) {
    const double at = (row + 0.5) * kCells / height_;
    const auto cell = static_cast<std::size_t>(at);
    const auto share = static_cast<float>(at - static_cast<double>(cell));
    const float* const above = stretched_.data() + cell * width;
    const float* const below = above + width;
    float* const out = field_.data() + static_cast<std::size_t>(row) * width;
    for (std::size_t column = 0; column < width; ++column)
      out[column] = above[column] + share * (below[column] - above[column]);
  }
}

// Brightness (1 - (d / half width)^2)^2 at distance d from a circle of radius R, with d taken as (r^2 - R^2) / 2R. An
// arc fades out around both ends.
void StrayLight::add_ring(bool arc, Random& random) {
  const double x = across_ * random.uniform(-0.1, 1.1), y = down_ * random.uniform(-0.1, 1.1);
  const double radius = random.uniform(0.1, 0.7), half_width = random.uniform(0.01, 0.04);
  const optics::SineCosine middle = optics::sine_cosine_of_degrees(random.uniform(0, 360));
  const optics::SineCosine half_angle = optics::sine_cosine_of_degrees(random.uniform(10, 60));
  const double strength = random.uniform(0.2, 1);
  const double pitch = across_ / width_;
  const auto per_width = static_cast<float>(0.5 / (radius * half_width));
  const auto radius2 = static_cast<float>(radius * radius);
  // A full ring is an arc that no angle excludes.
  const auto fade = static_cast<float>(arc ? 8 / radius : 0);
  const auto start = static_cast<float>(arc ? -8 * half_angle.cosine : 1);
  const auto along_x = static_cast<float>(middle.cosine), along_y = static_cast<float>(middle.sine);
  const auto bright = static_cast<float>(strength), step = static_cast<float>(pitch);
  const auto left = static_cast<float>(0.5 * pitch - x);
  for (int row = 0; row < height_; ++row) {
    const double dy_exact = (row + 0.5) * pitch - y;
    if (std::fabs(dy_exact) > radius + 2 * half_width) continue;
    const auto dy = static_cast<float>(dy_exact);
    float* const out = rings_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
    for (int column = 0; column < width_; ++column) {
      const float dx = left + step * static_cast<float>(column);
      const float d = (dx * dx + dy * dy - radius2) * per_width;
      float profile = 1 - d * d;
      profile = profile < 0 ? 0.0F : profile;
      float within = start + fade * (dx * along_x + dy * along_y);
      within = within < 0 ? 0.0F : within;
      within = within > 1 ? 1.0F : within;
      out[column] += bright * within * (profile * profile);
    }
  }
}

}  // namespace relign::imaging
