#include "imaging/ghost_paths.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace relign::imaging {
namespace {

using optics::AtFace;
using optics::GhostWalk;
using optics::kPi;
using optics::Vec3;
using optics::WalkingRay;

// The paper's renderer: from the fifth event on a path survives with its throughput, at most 0.95.
constexpr int kRouletteFrom = 5;
constexpr double kRouletteMost = 0.95;

}  // namespace

void GhostPaths::place(const optics::Assembly& assembly, const optics::Motion& lens_to_world,
                       const std::optional<optics::Motion>& into_print) {
  into_print_ = into_print;
  walk_.set(assembly);
  lens_to_world_ = lens_to_world;
  world_to_lens_ = optics::inverse(lens_to_world);
  // Polygons around the circles at both ends of each piece of glass.
  constexpr int kSides = 16;
  constexpr double kAround = 1.0195911582083184;  // 1 / cos(pi / kSides)
  rims_.clear();
  for (const optics::GlassBody& body : walk_.bodies())
    for (const double z : {body.low_z, body.high_z})
      for (int side = 0; side < kSides; ++side) {
        const optics::SineCosine angle = optics::sine_cosine_of_degrees(360.0 / kSides * side);
        const Vec3 rim = (kAround * body.radius) * Vec3{angle.cosine, angle.sine, 0} + Vec3{0, 0, z};
        rims_.push_back(lens_to_world.point(body.placement.point(rim)));
      }
}

DirectionEllipse GhostPaths::towards_lens(const Vec3& middle, double half_width, double half_height) const {
  // Great circles between the corners of the polygons curve outwards; and places between those tested here.
  constexpr double kMargin = 1.02;
  for (const Vec3& rim : rims_)
    if (!(rim.z < middle.z)) return {};
  const auto for_directions = [&](double x, double y, const auto& use) {
    for (const Vec3& rim : rims_) {
      const Vec3 to = unit(rim - Vec3{middle.x + x * half_width, middle.y + y * half_height, middle.z});
      use(to.x, to.y);
    }
  };
  const auto box_at = [&](double x, double y) {
    double low_p = 1, high_p = -1, low_q = 1, high_q = -1;
    for_directions(x, y, [&](double p, double q) {
      low_p = std::min(low_p, p);
      high_p = std::max(high_p, p);
      low_q = std::min(low_q, q);
      high_q = std::max(high_q, q);
    });
    return std::array{0.5 * (low_p + high_p), 0.5 * (low_q + high_q), 0.5 * (high_p - low_p), 0.5 * (high_q - low_q)};
  };
  const auto here = box_at(0, 0), left = box_at(-1, 0), right = box_at(1, 0), below = box_at(0, -1),
             above = box_at(0, 1);
  DirectionEllipse found{here[0], here[1], {}, here[2], here[3]};
  for (const std::size_t k : {0U, 1U}) {
    found.slope[2 * k] = (right[k] - left[k]) / (2 * half_width);
    found.slope[2 * k + 1] = (above[k] - below[k]) / (2 * half_height);
  }
  double farthest = 0;
  for (const double x : {-1, 0, 1})
    for (const double y : {-1, 0, 1}) {
      const double dx = x * half_width, dy = y * half_height;
      const double p0 = here[0] + found.slope[0] * dx + found.slope[1] * dy;
      const double q0 = here[1] + found.slope[2] * dx + found.slope[3] * dy;
      for_directions(x, y, [&](double p, double q) {
        farthest = std::max(farthest, optics::square((p - p0) / here[2]) + optics::square((q - q0) / here[3]));
      });
    }
  const double scale = kMargin * std::sqrt(farthest);
  found.half_p *= scale;
  found.half_q *= scale;
  return found;
}

bool GhostPaths::start_walk(const PathStart& start, WalkingRay& ray) const {
  return start_walk({start.x, start.y, scene_->sensor.z_mm}, start.p, start.q, ray);
}

bool GhostPaths::start_walk(const Vec3& place, double p, double q, WalkingRay& ray) const {
  const double rest = 1 - p * p - q * q;
  if (!(rest > 0)) return false;
  return walk_.enter_from_image(world_to_lens_.point(place), world_to_lens_.direction({p, q, -std::sqrt(rest)}), ray);
}

std::optional<GhostPaths::OnSensor> GhostPaths::intersect_sensor(const WalkingRay& ray) const {
  const Vec3 at = lens_to_world_.point(ray.at), direction = lens_to_world_.direction(ray.direction);
  if (!(direction.z > 0)) return std::nullopt;
  const Sensor& sensor = scene_->sensor;
  const Vec3 hit = at + ((sensor.z_mm - at.z) / direction.z) * direction;
  const double column = (hit.x - sensor.left_mm) / sensor.pitch_mm, row = (sensor.top_mm - hit.y) / sensor.pitch_mm;
  if (!(column > 0 && column < sensor.width && row > 0 && row < sensor.height)) return std::nullopt;
  if (!walk_.leaves_to_image(ray, world_to_lens_.point(hit))) return std::nullopt;
  return OnSensor{
      hit, static_cast<std::size_t>(row) * static_cast<std::size_t>(sensor.width) + static_cast<std::size_t>(column)};
}

bool GhostPaths::scatter(const OnSensor& from, WalkingRay& ray, PathRandom& random) const {
  double p = 0, q = 0;
  do {  // uniform on the disc of direction cosines: light scattered evenly
    p = 2 * random.unit() - 1;
    q = 2 * random.unit() - 1;
  } while (!(p * p + q * q < 1));
  return start_walk(from.place, p, q, ray);
}

double GhostPaths::radiance(const WalkingRay& ray) const {
  const Vec3 at = lens_to_world_.point(ray.at), direction = lens_to_world_.direction(ray.direction);
  if (!(direction.z < 0)) return 0;
  const double distance = (scene_->emitter.z_mm - at.z) / direction.z;
  if (!(distance > 0)) return 0;
  Vec3 hit = {at.x + distance * direction.x, at.y + distance * direction.y, scene_->emitter.z_mm};
  if (into_print_) hit = into_print_->point(hit);
  return scene_->emitter.radiance_at(hit.x, hit.y);
}

double GhostPaths::trace(const PathStart& start, PathRandom& random) const {
  WalkingRay ray;
  if (!start_walk(start, ray)) return 0;
  double weight = 1;
  for (int events = 1; events <= kMaxEvents; ++events) {
    AtFace met;
    switch (walk_.advance(ray, met)) {
      case GhostWalk::Next::lost:
        return 0;
      case GhostWalk::Next::object_side:
        return weight * radiance(ray);
      case GhostWalk::Next::image_side:
        if (const auto hit = albedo_ > 0 ? intersect_sensor(ray) : std::nullopt; !hit || !scatter(*hit, ray, random))
          return 0;
        weight *= albedo_;
        break;
      case GhostWalk::Next::face:
        if (random.unit() < met.reflectance)
          walk_.reflect(met, ray);
        else
          walk_.refract(met, ray);
        break;
    }
    if (events >= kRouletteFrom) {
      const double survival = std::min(weight, kRouletteMost);
      if (!(random.unit() < survival)) return 0;
      weight /= survival;
    }
  }
  return 0;
}

}  // namespace relign::imaging
