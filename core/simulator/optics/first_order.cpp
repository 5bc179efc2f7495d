#include "optics/first_order.h"

#include <cmath>
#include <vector>

#include "optics/elementary.h"

namespace relign::optics {
namespace {

// (height, index * angle) before -> after.
struct Matrix {
  double a = 1, b = 0, c = 0, d = 1;
};

Matrix then(const Matrix& later, const Matrix& earlier) {
  return {later.a * earlier.a + later.b * earlier.c, later.a * earlier.b + later.b * earlier.d,
          later.c * earlier.a + later.d * earlier.c, later.c * earlier.b + later.d * earlier.d};
}

// Through the faces from `first` to before `end`, with transfers from from_z and to to_z in the media there; a stop in
// front of a convex face can be behind its vertex, which makes the transfer negative.
Matrix through(const std::vector<const Face*>& faces, std::size_t first, std::size_t end, double from_z, double to_z) {
  Matrix system;
  double z = from_z;
  double index = first == 0 ? 1 : faces[first - 1]->index_after;
  for (std::size_t f = first; f < end; ++f) {
    const Face& face = *faces[f];
    system = then({1, (face.z_mm - z) / index, 0, 1}, system);
    system = then({1, 0, -(face.index_after - index) * face.vertex_curvature(), 1}, system);
    index = face.index_after;
    z = face.z_mm;
  }
  return then({1, (to_z - z) / index, 0, 1}, system);
}

}  // namespace

FirstOrder first_order(const Prescription& lens) {
  const double first = lens.elements.front().faces.front().z_mm;
  const double last = lens.elements.back().faces.back().z_mm;
  const Stop& stop = lens.aperture_stop();
  std::vector<const Face*> faces;
  for (const Element& element : lens.elements)
    for (const Face& face : element.faces) faces.push_back(&face);
  const std::size_t count = faces.size(), before_stop = lens.faces_before(stop);
  const Matrix whole = through(faces, 0, count, first, last);
  const double behind = faces.back()->index_after;  // -1 behind an odd number of mirrors
  FirstOrder data;
  data.focal_length = -1 / whole.c;
  data.back_focal_length = -whole.a / whole.c * behind;
  // The front focal point is at first + d / c (c < 0: before the lens, as a positive lens alone has it).
  data.front_focal_length = whole.d / whole.c;
  data.overall_length = last - first;
  data.image_distance = lens.image_z_mm - last;

  // Entrance pupil: the stop imaged to the front. A ray (y, u) before the lens meets the stop at
  // a y + b u; the chief ray at 0.
  double stop_radius = stop.opening_radius_mm;
  if (before_stop > 0) {
    const Matrix front = through(faces, 0, before_stop, first, stop.z_mm);
    data.entrance_pupil_z = first + front.b / front.a;
    if (lens.entrance_pupil_diameter_mm > 0) stop_radius = front.a * lens.entrance_pupil_diameter_mm / 2;
    data.entrance_pupil_diameter = 2 * stop_radius / front.a;
  } else {
    if (lens.entrance_pupil_diameter_mm > 0) stop_radius = lens.entrance_pupil_diameter_mm / 2;
    data.entrance_pupil_z = stop.z_mm;
    data.entrance_pupil_diameter = 2 * stop_radius;
  }
  // Exit pupil: the stop's centre and rim imaged to the back.
  if (before_stop < count) {
    const Matrix rear = through(faces, before_stop, count, stop.z_mm, last);
    data.exit_pupil_from_last = -rear.b / rear.d * behind;
    data.exit_pupil_diameter = 2 * stop_radius * (rear.a + data.exit_pupil_from_last / behind * rear.c);
  } else {
    data.exit_pupil_from_last = stop.z_mm - last;
    data.exit_pupil_diameter = 2 * stop_radius;
  }
  data.exit_pupil_z = last + data.exit_pupil_from_last;
  data.f_number = data.focal_length / data.entrance_pupil_diameter;
  const SineCosine field = sine_cosine_of_degrees(lens.half_field_deg);
  data.paraxial_image_height = data.focal_length * field.sine / field.cosine;
  return data;
}

}  // namespace relign::optics
