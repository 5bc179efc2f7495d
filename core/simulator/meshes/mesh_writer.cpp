#include "meshes/mesh_writer.h"

#include <algorithm>

#include "base/error.h"
#include "base/text.h"
#include "optics/face_shape.h"

namespace relign::meshes {
namespace {

constexpr double kMaxWrittenTriangles = 2e7;
constexpr int kMinRimCorners = 48;  // of a rim

using optics::kPi;
using optics::sag;

// The vertices of one ring: the first and their number; a single one is on the axis.
struct Ring {
  std::uint32_t first = 0;
  int corners = 0;
};

class Builder {
 public:
  explicit Builder(double pitch_mm) : pitch_(pitch_mm) {}

  Ring ring(double radius, double z, int corners) {
    const Ring made{static_cast<std::uint32_t>(mesh_.vertices.size()), corners};
    for (int i = 0; i < corners; ++i) {
      const optics::SineCosine angle = optics::sine_cosine_of_degrees(360.0 * i / corners);
      mesh_.vertices.push_back({radius * angle.cosine, radius * angle.sine, z});
    }
    return made;
  }

  // From the vertex to the rim, faces looking towards -z; returns the rim.
  Ring face(const optics::Face& face, int rim_corners, bool towards_image) {
    const double edge = face.clear_radius_mm;
    const double slope = std::min(1.0, std::fabs(face.curvature) * edge);
    const bool curved = face.is_sphere() && face.curvature != 0;
    const double arc = !curved ? edge : std::asin(slope) / std::fabs(face.curvature);
    const int rings = std::max(3, static_cast<int>(std::ceil(arc / pitch_)));
    Ring inner = ring(0, face.z_mm, 1);
    for (int k = 1; k <= rings; ++k) {
      const double share = static_cast<double>(k) / rings;
      const double radius = k == rings ? edge
                            : !curved  ? share * edge
                                       : std::sin(share * std::asin(slope)) / std::fabs(face.curvature);
      const int corners = k == rings ? rim_corners : corners_at(radius, 6);
      const Ring outer = ring(radius, face.z_mm + sag(face, radius), corners);
      connect(inner, outer, towards_image);
      inner = outer;
    }
    return inner;
  }

  // Connects two rings around the axis. `turned`: faces look to +z if the second ring is the larger one.
  void connect(const Ring& a, const Ring& b, bool turned) {
    const int steps_a = a.corners == 1 ? 0 : a.corners, steps_b = b.corners;
    int i = 0, j = 0;
    const auto at = [](const Ring& ring, int k) { return ring.first + static_cast<std::uint32_t>(k % ring.corners); };
    while (i < steps_a || j < steps_b) {
      // The next corner belongs to the ring with less progress.
      const bool on_b =
          i == steps_a || (j < steps_b && static_cast<double>(j + 1) / steps_b <= static_cast<double>(i + 1) / steps_a);
      const std::uint32_t third = on_b ? at(b, j + 1) : at(a, i + 1);
      if (turned)
        mesh_.triangles.push_back({at(a, i), at(b, j), third});
      else
        mesh_.triangles.push_back({at(b, j), at(a, i), third});
      on_b ? ++j : ++i;
    }
  }

  int corners_at(double radius, int least) const {
    return std::max(least, static_cast<int>(std::ceil(2 * kPi * radius / pitch_)));
  }
  Mesh take() { return std::move(mesh_); }

 private:
  double pitch_;
  Mesh mesh_;
};

// Whether the straight line between the rims stays on the glass side of the larger face.
bool cone_fits(const optics::Face& front, const optics::Face& back) {
  const double r1 = front.clear_radius_mm, r2 = back.clear_radius_mm;
  const double z1 = front.z_mm + sag(front, r1), z2 = back.z_mm + sag(back, r2);
  constexpr int kPlaces = 64;
  for (int k = 1; k < kPlaces; ++k) {
    const double share = static_cast<double>(k) / kPlaces;
    const double r = r1 + share * (r2 - r1), z = z1 + share * (z2 - z1);
    if (r1 > r2 ? z <= front.z_mm + sag(front, r) : r2 > r1 && z >= back.z_mm + sag(back, r)) return false;
  }
  return true;
}

}  // namespace

void check_on_axis(const optics::Element& element) {
  if (!element.placement.is_identity())
    throw Error(ErrorKind::bad_input, "the lens file decentres or tilts element " + element.name +
                                          "; lenses of meshes need elements on the axis");
}

Mesh element_mesh(const optics::Element& element, double pitch_mm) {
  if (element.faces.size() != 2)
    throw Error(ErrorKind::bad_input, "element " + element.name + " has " + counted(element.faces.size(), "face") +
                                          "; meshes need elements with two: define each glass of a cemented "
                                          "element as a separate element");
  check_on_axis(element);
  const optics::Face &front = element.faces[0], &back = element.faces[1];
  const double largest = std::max(front.clear_radius_mm, back.clear_radius_mm);
  if (2 * 2 * kPi * largest * largest / (pitch_mm * pitch_mm) > kMaxWrittenTriangles)
    throw Error(ErrorKind::bad_input, "a pitch of " + shortest(pitch_mm) + " mm gives too many triangles for element " +
                                          element.name + " of radius " + shortest(largest) + " mm; allowed are about " +
                                          std::to_string(static_cast<int>(kMaxWrittenTriangles)) +
                                          "; use a larger pitch");
  if (front.z_mm + sag(front, front.clear_radius_mm) >= back.z_mm + sag(back, back.clear_radius_mm))
    throw Error(ErrorKind::bad_input, "element " + element.name +
                                          " has no edge: the rims of its faces, at semi-diameters " +
                                          shortest(front.clear_radius_mm) + " and " + shortest(back.clear_radius_mm) +
                                          " mm, touch or cross; use smaller semi-diameters");
  Builder builder(pitch_mm);
  const int corners = builder.corners_at(largest, kMinRimCorners);
  const Ring front_rim = builder.face(front, corners, false);
  const Ring back_rim = builder.face(back, corners, true);
  Ring last = front_rim;
  if (!cone_fits(front, back)) {
    // A plane ring at the smaller rim's height, out to the larger radius.
    const bool front_larger = front.clear_radius_mm > back.clear_radius_mm;
    const double z =
        front_larger ? back.z_mm + sag(back, back.clear_radius_mm) : front.z_mm + sag(front, front.clear_radius_mm);
    const Ring corner = builder.ring(largest, z, corners);
    builder.connect(last, corner, false);
    last = corner;
  }
  builder.connect(last, back_rim, false);
  return builder.take();
}

}  // namespace relign::meshes
