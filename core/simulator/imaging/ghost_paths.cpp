#include "imaging/ghost_paths.h"

#include <algorithm>
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

// Extremes of a / sqrt(a^2 + b^2 + c^2): it grows with a, and falls with |b| and |c| where a is positive.
double cosine_of(double a, double least_b, double most_b, double least_c, double most_c, bool highest) {
  const bool far = highest ? a < 0 : a > 0;
  const double b = far ? most_b : least_b, c = far ? most_c : least_c;
  return a / std::sqrt(a * a + b * b + c * c);
}

struct Span {
  double low, high;
  double least() const { return low > 0 ? low : high < 0 ? -high : 0; }
  double most() const { return std::max(std::fabs(low), std::fabs(high)); }
};

}  // namespace

void GhostPaths::place(const optics::Assembly& assembly, const optics::Motion& lens_to_world,
                       const std::optional<optics::Motion>& into_print) {
  into_print_ = into_print;
  walk_.set(assembly);
  lens_to_world_ = lens_to_world;
  world_to_lens_ = optics::inverse(lens_to_world);
}

DirectionBox GhostPaths::towards_lens(double low_x, double high_x, double low_y, double high_y) const {
  DirectionBox all{1, -1, 1, -1};
  for (const optics::GlassBody& body : walk_.bodies()) {
    // The body's box in world coordinates: circles at its two ends.
    const optics::Motion to_world = optics::after(lens_to_world_, body.placement);
    const Vec3 axis = to_world.direction({0, 0, 1});
    const Vec3 low = to_world.point({0, 0, body.low_z}), high = to_world.point({0, 0, body.high_z});
    const auto span = [&](double a, double b, double along) {
      const double reach = body.radius * std::sqrt(std::max(0.0, 1 - along * along));
      return Span{std::min(a, b) - reach, std::max(a, b) + reach};
    };
    const Span x = span(low.x, high.x, axis.x), y = span(low.y, high.y, axis.y), z = span(low.z, high.z, axis.z);
    const double sensor_z = scene_->sensor.z_mm;
    if (!(z.high < sensor_z)) return {};
    const Span dx{x.low - high_x, x.high - low_x}, dy{y.low - high_y, y.high - low_y};
    const Span dz{sensor_z - z.high, sensor_z - z.low};
    all.low_p = std::min(all.low_p, cosine_of(dx.low, dy.least(), dy.most(), dz.low, dz.high, false));
    all.high_p = std::max(all.high_p, cosine_of(dx.high, dy.least(), dy.most(), dz.low, dz.high, true));
    all.low_q = std::min(all.low_q, cosine_of(dy.low, dx.least(), dx.most(), dz.low, dz.high, false));
    all.high_q = std::max(all.high_q, cosine_of(dy.high, dx.least(), dx.most(), dz.low, dz.high, true));
  }
  constexpr double kRounding = 1e-9;
  return {all.low_p - kRounding, all.high_p + kRounding, all.low_q - kRounding, all.high_q + kRounding};
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

double GhostPaths::ghost_part(const PathStart& start, PathRandom& random, const float* straight,
                              std::vector<Branch>& waiting) const {
  Branch branch;
  if (!start_walk(start, branch.ray)) return 0;
  const auto survives = [&](double& weight) {
    if (weight >= kMinWeight) return true;
    if (!(random.unit() * kMinWeight < weight)) return false;
    weight = kMinWeight;
    return true;
  };
  double seen = 0;
  waiting.clear();
  for (bool more = true; more;) {
    bool alive = ++branch.events <= kMaxEvents;
    AtFace met;
    switch (alive ? walk_.advance(branch.ray, met) : GhostWalk::Next::lost) {
      case GhostWalk::Next::lost:
        alive = false;
        break;
      case GhostWalk::Next::object_side:
        if (branch.reflected) seen += branch.weight * radiance(branch.ray);
        alive = false;
        break;
      case GhostWalk::Next::image_side:
        branch.weight *= albedo_;
        alive = false;
        if (const auto hit = branch.weight > 0 ? intersect_sensor(branch.ray) : std::nullopt) {
          // Lambertian: the mean incident radiance is the irradiance over pi.
          seen += branch.weight * static_cast<double>(straight[hit->pixel]) / kPi;
          branch.reflected = false;
          alive = survives(branch.weight) && scatter(*hit, branch.ray, random);
        }
        break;
      case GhostWalk::Next::face: {
        branch.reflected |= met.is_edge;
        Branch other = branch;
        other.weight *= met.reflectance;
        if (survives(other.weight)) {
          other.reflected = true;
          walk_.reflect(met, other.ray);
          waiting.push_back(other);
        }
        branch.weight *= 1 - met.reflectance;
        alive = met.reflectance < 1 && survives(branch.weight);
        if (alive) walk_.refract(met, branch.ray);
        break;
      }
    }
    if (alive) continue;
    more = !waiting.empty();
    if (!more) break;
    branch = waiting.back();
    waiting.pop_back();
  }
  return seen;
}

}  // namespace relign::imaging
