#include "optics/ray_lanes.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "optics/face_shape.h"

namespace relign::optics {
namespace {

void put_motion(const Motion& motion, double (&rotation)[9], double (&shift)[3]) {
  std::copy(motion.rotation.begin(), motion.rotation.end(), rotation);
  shift[0] = motion.translation.x;
  shift[1] = motion.translation.y;
  shift[2] = motion.translation.z;
}

void meet_polynomial(RayLanes& rays, const Face& face, const FaceBounds& bounds, int count) {
  for (int i = 0; i < count; ++i) {
    if (!(rays.alive[i] > 0)) continue;
    const std::optional<FacePoint> met =
        intersect(face, bounds, {rays.px[i], rays.py[i], rays.pz[i]}, {rays.lx[i], rays.ly[i], rays.lz[i]});
    if (!met) {
      rays.alive[i] = 0;
      continue;
    }
    rays.hx[i] = met->at.x;
    rays.hy[i] = met->at.y;
    rays.hz[i] = met->at.z;
    rays.nx[i] = met->normal.x;
    rays.ny[i] = met->normal.y;
    rays.nz[i] = met->normal.z;
  }
}

}  // namespace

void LanePath::pass_stops_before(std::size_t face, const Prescription& lens) {
  for (const Stop& stop : lens.stops) {
    if (stop.on_face || lens.faces_before(stop) != face) continue;
    Step step;
    step.is_stop = true;
    step.z_mm = stop.z_mm;
    step.radius_mm = stop.opening_radius_mm;
    steps_.push_back(step);
  }
}

LanePath::LanePath(const Assembly& assembly) {
  const Prescription& lens = assembly.lens();
  std::size_t number = 0;  // of the face, over all elements
  for (std::size_t e = 0; e < lens.elements.size(); ++e)
    for (std::size_t f = 0; f < lens.elements[e].faces.size(); ++f, ++number) {
      pass_stops_before(number, lens);
      const Face& face = lens.elements[e].faces[f];
      Step step;
      LaneFace& lane = step.face;
      put_motion(inverse(assembly.placement(e)), lane.into, lane.into_shift);
      put_motion(assembly.placement(e), lane.out, lane.out_shift);
      lane.z_mm = face.z_mm;
      lane.curvature = face.curvature;
      lane.conic = face.conic;
      lane.clear_mm = face.clear_radius(Apertures::mesh);
      lane.stop_mm = 1e300;
      for (const Stop& stop : lens.stops)
        if (stop.on_face && *stop.before_face == number) lane.stop_mm = std::min(lane.stop_mm, stop.opening_radius_mm);
      lane.before = std::fabs(last_index_);
      lane.behind = std::fabs(face.index_after);
      lane.normal_sign = last_index_ < 0 ? -1 : 1;
      lane.mirror = face.mirror;
      if (!face.is_conic()) {
        step.polynomial = &face;
        step.bounds = &assembly.bounds(e, f, Apertures::mesh);
      }
      steps_.push_back(step);
      last_index_ = face.index_after;
    }
  pass_stops_before(number, lens);
}

void LanePath::trace(RayLanes& rays, int count, const LaneKernels& kernels) const {
  kernels.start(rays, count);
  for (const Step& step : steps_) {
    if (step.is_stop) {
      kernels.pass_stop(rays, step.z_mm, step.radius_mm, count);
      continue;
    }
    kernels.enter(rays, step.face, count);
    if (step.polynomial)
      meet_polynomial(rays, *step.polynomial, *step.bounds, count);
    else
      kernels.meet_conic(rays, step.face, count);
    kernels.refract(rays, step.face, count);
  }
  for (int i = 0; i < count; ++i)
    if (!(last_index_ * rays.dz[i] > 0)) rays.alive[i] = 0;
}

}  // namespace relign::optics
