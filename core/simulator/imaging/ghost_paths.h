// Traces single light paths from the sensor under transport `ghost`: reflected by faces, scattered by the sensor.
// Internal to imaging; used by ghost_image.cpp.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "imaging/path_random.h"
#include "imaging/scene_file.h"
#include "optics/ghost_walk.h"

namespace relign::imaging {

// Start of a path: a point on the sensor (world x and y, mm) and the direction cosines along x and y.
struct PathStart {
  double x, y;
  double p, q;
  bool is_direction() const { return p * p + q * q < 1; }
};

// Of direction cosines along x and y; the centre moves with the place on the sensor: centre + slope (x, y), relative to
// the middle of a box of pixels.
struct DirectionEllipse {
  double centre_p = 0, centre_q = 0, slope[4] = {}, half_p = 1, half_q = 1;
  double area() const { return optics::kPi * half_p * half_q; }
};

class GhostPaths {
 public:
  // `scene` must outlive the paths. sensor_albedo: share of light that the sensor scatters, Lambertian.
  GhostPaths(const SceneFile& scene, double sensor_albedo) : scene_(&scene), albedo_(sensor_albedo) {}
  // into_print: see Camera::capture.
  void place(const optics::Assembly& assembly, const optics::Motion& lens_to_world,
             const std::optional<optics::Motion>& into_print = std::nullopt);

  // All directions in which the lens can be hit from a box of pixels, given by its middle and half its width and height
  // (mm); the whole disc if they are not known.
  DirectionEllipse towards_lens(const optics::Vec3& middle, double half_width, double half_height) const;

  // As the paper's renderer does it: refracts or reflects at random at each face, with Russian roulette from the fifth
  // event on. Returns the radiance at the end of the path, weighted for roulette and sensor.
  double trace(const PathStart& start, PathRandom& random) const;
  const optics::GhostWalk& walk() const { return walk_; }

  // Paths end after this many events, with on average at most 0.95^60 of their initial weight.
  static constexpr int kMaxEvents = 64;

 private:
  bool start_walk(const PathStart& start, optics::WalkingRay& ray) const;
  bool start_walk(const optics::Vec3& place, double p, double q, optics::WalkingRay& ray) const;
  // The point where a ray that left towards the image hits the sensor, and its pixel, counted row by row.
  struct OnSensor {
    optics::Vec3 place;
    std::size_t pixel;
  };
  std::optional<OnSensor> intersect_sensor(const optics::WalkingRay& ray) const;
  // Starts a ray there in a random direction.
  bool scatter(const OnSensor& from, optics::WalkingRay& ray, PathRandom& random) const;
  // Radiance of a ray that left towards the object.
  double radiance(const optics::WalkingRay& ray) const;

  const SceneFile* scene_;
  double albedo_;
  optics::GhostWalk walk_;
  optics::Motion lens_to_world_, world_to_lens_;
  std::vector<optics::Vec3> rims_;  // world points around which all glass is
  std::optional<optics::Motion> into_print_;
};

}  // namespace relign::imaging
