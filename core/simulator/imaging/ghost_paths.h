// What one path from the sensor sees under transport `ghost`: reflected by faces, scattered by the sensor.
// Not part of the room's face; ghost_image.cpp uses it.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "imaging/dice.h"
#include "imaging/scene_file.h"
#include "optics/ghost_walk.h"

namespace relign::imaging {

// Where a path starts: a place on the sensor (world x and y, mm) and the direction cosines along x and y.
struct PathStart {
  double x, y;
  double p, q;
  bool is_direction() const { return p * p + q * q < 1; }
};

// Direction cosines along x and y; area in units of direction cosines squared.
struct DirectionBox {
  double low_p = -1, high_p = 1, low_q = -1, high_q = 1;
  double area() const { return (high_p - low_p) * (high_q - low_q); }
};

class GhostPaths {
 public:
  // `scene` outlives the paths. The sensor scatters this share of the light that it does not take, evenly.
  GhostPaths(const SceneFile& scene, double sensor_albedo) : scene_(&scene), albedo_(sensor_albedo) {}
  void place(const optics::Assembly& assembly, const optics::Motion& lens_to_world);

  // Holds every direction from a rectangle of the sensor in which the lens can be met.
  DirectionBox towards_lens(double low_x, double high_x, double low_y, double high_y) const;

  // As the paper's renderer plays it: one way at each face by a die, Russian roulette from the fifth event on.
  // The radiance that is met, times what roulette and sensor made of it.
  double play(const PathStart& start, Dice& dice) const;
  // The expected value of the same without the path that is reflected nowhere: both ways at each face, weighted.
  // Little noise: only what weighs less than kLeastWeight is left to chance. Where the sensor scatters a path, the
  // light that arrives there straight through the lens is taken from `straight`, the irradiances of its pixels in this
  // pose, row by row (unbiased where `straight` is): a path would have to hit the lens's small pupil to meet it. Light
  // that is reflected or scattered once more is followed on. `waiting` is working space.
  struct Branch {
    optics::WalkingRay ray;
    double weight = 1;
    int events = 0;
    bool reflected = false;
  };
  double ghost_part(const PathStart& start, Dice& dice, const float* straight, std::vector<Branch>& waiting) const;

  // Least variance times time, measured in relign_od-package from 0.0002 to 0.05.
  static constexpr double kLeastWeight = 0.005;
  // A path is given up here. By then it carries at most 0.95^60 of what it started with in the mean.
  static constexpr int kMostEvents = 64;

 private:
  bool start_walk(const PathStart& start, optics::WalkingRay& ray) const;
  bool start_walk(const optics::Vec3& place, double p, double q, optics::WalkingRay& ray) const;
  // The place where a ray that left towards the image meets the sensor, and its pixel, row by row.
  struct OnSensor {
    optics::Vec3 place;
    std::size_t pixel;
  };
  std::optional<OnSensor> meet_sensor(const optics::WalkingRay& ray) const;
  // Starts a ray there in a random direction.
  bool scatter(const OnSensor& from, optics::WalkingRay& ray, Dice& dice) const;
  // A ray that left towards the object.
  double radiance(const optics::WalkingRay& ray) const;

  const SceneFile* scene_;
  double albedo_;
  optics::GhostWalk walk_;
  optics::Motion lens_to_world_, world_to_lens_;
};

}  // namespace relign::imaging
