// The arithmetic of a certificate (certificate.h), for CPU and GPU: the rays that check a pixel, and whether images
// sample them. NVRTC compiles this header.
#pragma once

#include "imaging/tile_steps.h"
#include "optics/direction_windows.h"
#include "optics/ray_steps.h"

namespace relign::imaging {

struct CheckRay {
  optics::Vec3 place;  // world
  double p, q;         // direction cosines

  optics::Vec3 direction() const { return {p, q, -std::sqrt(std::max(1 - p * p - q * q, 1e-12))}; }
};

struct CheckSource {
  PixelGrid sensor;
  optics::DirectionWindows windows;  // in which the design sends light
  optics::Motion lens_to_world, world_to_lens;
  std::uint32_t seed_low, seed_high;

  // Ray `index` of a pixel, from anywhere in it. Half of the rays are drawn near the directions in which the design
  // sends light, in twice that range, since few others hit narrow pupils; the others from the whole disc.
  CheckRay draw(int column, int row, std::uint32_t index) const {
    std::uint32_t words[4] = {
        index,
        static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(sensor.width) + static_cast<std::uint32_t>(column),
        0, 0};
    philox_rounds(words, seed_low, seed_high);
    const auto unit = [&](int k) { return words[k] * 0x1p-32; };
    CheckRay ray;
    ray.place = sensor.place(column + unit(0), row + unit(1));
    if (index % 2 != 0 && near_light(ray.place, unit(2), unit(3), ray.p, ray.q)) return ray;
    float p = 0, q = 0;
    optics::unit_disc(words[2], words[3], p, q);
    ray.p = static_cast<double>(p);
    ray.q = static_cast<double>(q);
    return ray;
  }

 private:
  // False if the design sends no light to the place, or not in this direction.
  bool near_light(const optics::Vec3& place, double u, double v, double& p, double& q) const {
    constexpr double kWidening = 2;
    const optics::Vec3 at = world_to_lens.point(place);
    const optics::DirectionWindow window = windows.at(at);
    if (window.empty) return false;
    const auto side = [&](int axis, double share) {
      return (window.low[axis] + window.high[axis]) / 2 +
             kWidening * (share - 0.5) * (window.high[axis] - window.low[axis]);
    };
    const double away = side(0, u), across = side(1, v);
    const double radius = std::sqrt(at.x * at.x + at.y * at.y);
    const double cosine = radius > 0 ? at.x / radius : 1, sine = radius > 0 ? at.y / radius : 0;
    const double a = cosine * away - sine * across, b = sine * away + cosine * across;
    if (!(a * a + b * b < 1)) return false;
    const optics::Vec3 direction = lens_to_world.direction({a, b, -std::sqrt(1 - a * a - b * b)});
    p = direction.x;
    q = direction.y;
    return direction.z < 0;
  }
};

// Whether a traced ray reached the emitter; x and y on its plane.
inline bool reaches_emitter(const optics::FloatRay& ray, float half_emitter) {
  return ray.margin > 0 && ray.lz < 0 && optics::magnitude(ray.x) < half_emitter &&
         optics::magnitude(ray.y) < half_emitter;
}

// Whether an image's rays include this one, from a pixel of a fitted tile that the emitter can light.
inline bool is_sampled(const optics::TileStart& start, bool whole_disc, const optics::Vec3& middle,
                       const CheckRay& ray) {
  constexpr double kRounding = 1e-4;
  if (whole_disc) return true;
  const auto of = [](float value) { return static_cast<double>(value); };
  const double x = ray.place.x - middle.x, y = ray.place.y - middle.y;
  const double dp = ray.p - (of(start.centre[0]) + of(start.slope[0]) * x + of(start.slope[1]) * y);
  const double dq = ray.q - (of(start.centre[1]) + of(start.slope[2]) * x + of(start.slope[3]) * y);
  const double a = dp / of(start.axes[0]), b = (dq - of(start.axes[2]) * a) / of(start.axes[3]);
  return a * a + b * b <= 1 + kRounding;
}

}  // namespace relign::imaging
