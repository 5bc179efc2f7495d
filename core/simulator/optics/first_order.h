// First-order (paraxial) data of the perfect lens, by transfer matrices; mm. Behind mirrors indices have the sign of
// the light's direction, as in Welford, Aberrations of Optical Systems; distances from a vertex are positive towards
// +z.
#pragma once

#include "optics/prescription.h"

namespace relign::optics {

struct FirstOrder {
  double focal_length = 0;        // EFL
  double back_focal_length = 0;   // last vertex to rear focal point
  double front_focal_length = 0;  // first vertex to front focal point, positive behind it (as CODE V prints it)
  double f_number = 0;
  double overall_length = 0;  // first to last vertex
  double image_distance = 0;  // last vertex to the image plane
  double entrance_pupil_diameter = 0;
  double entrance_pupil_z = 0;  // from the first vertex
  double exit_pupil_diameter = 0;
  double exit_pupil_z = 0;           // from the first vertex
  double exit_pupil_from_last = 0;   // from the last vertex
  double paraxial_image_height = 0;  // focal length * tan(half field)
};

FirstOrder first_order(const Prescription& lens);

}  // namespace relign::optics
