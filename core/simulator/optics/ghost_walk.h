// Non-sequential tracing of single rays among the elements and stops of a lens: at each surface the caller decides
// whether the ray is refracted or reflected.
//
// Used for ghosts. Faces are visited in order, back and forth, so that no search structure is needed. A ray that misses
// the next face may hit an element's edge, which refracts: a cylinder with the larger of both semi-diameters, closed by
// a plane ring at the rim of the smaller face. Only such rays are searched among all surfaces. Edges are shaded like
// the meshes of the paper's renderer, whose vertices have one normal each: halfway between both sides at every rim,
// interpolated in between. Stops reach out to the barrel; both absorb. Scalar double with + - * / and square roots
// only: the same bits everywhere.
#pragma once

#include <vector>

#include "optics/assembly.h"
#include "optics/rigid.h"

namespace relign::optics {

// Lens coordinates. Surfaces are faces and stops, counted from the object side; gap g is between surfaces g - 1
// and g.
struct WalkingRay {
  Vec3 at;
  Vec3 direction;         // unit
  int gap = 0;            // where it is; -1: in air beside the elements
  int glass = 0;          // the gap whose glass it is in; 0: in air
  bool to_image = false;  // towards surface `gap`, otherwise towards surface `gap` - 1
  int left = -1;          // the face it has just left; -1: none
};

// A ray on a face or an edge, before the caller reflects or refracts it.
struct AtFace {
  int surface = 0;
  bool is_edge = false;
  Vec3 at;
  Vec3 normal;              // unit; of faces towards the image side
  Vec3 outward;             // of edges: towards the air
  double cosine = 0;        // of direction and normal
  double cosine_after = 0;  // the same of the refracted ray; 0: total reflection
  double index_ratio = 1;   // before / after
  double reflectance = 1;   // unpolarised; 1: total reflection
};

// The extent of one piece of glass along the axis and its radius, in the frame of `placement`.
struct GlassBody {
  Motion placement;
  double low_z = 0, high_z = 0, radius = 0;
};

class GhostWalk {
 public:
  // Does not allocate from the second call on.
  void set(const Assembly& assembly);

  // Starts a ray behind the lens, towards the object. False if the barrel's rear rim blocks it.
  bool enter_from_image(const Vec3& at, const Vec3& direction, WalkingRay& ray) const;
  // Whether a ray that left the lens towards the image also leaves the barrel, on its way to the point `at`.
  bool leaves_to_image(const WalkingRay& ray, const Vec3& at) const;

  enum class Next { face, object_side, image_side, lost };
  // Advances a ray to the next face or edge, which `met` describes.
  Next advance(WalkingRay& ray, AtFace& met) const;
  void reflect(const AtFace& met, WalkingRay& ray) const;
  void refract(const AtFace& met, WalkingRay& ray) const;

  // All pieces of glass that a ray from behind can hit.
  const std::vector<GlassBody>& bodies() const { return bodies_; }

 private:
  friend class GhostTables;
  static constexpr double kNearest = 1e-9;  // mm: closer hits are the point that the ray has just left

  struct Surface {
    bool is_stop = false;
    Vec3 vertex, axis;  // axis: unit, towards the image side
    double curvature = 0, clear_radius2 = 0;
    double index_front = 1, index_back = 1;
  };
  struct Normal {
    double radial = 0, axial = 0;
  };
  struct Edge {
    int gap = 0;
    Vec3 origin, axis;  // heights are counted from here
    double index = 1;
    double radius = 0, low_z = 0, high_z = 0;  // cylinder
    double ring_z = 0, ring_inner_radius = 0;  // plane ring, out to the cylinder
    bool ring_faces_image = false;
    Normal cylinder_low, cylinder_high, ring_inner, ring_outer;  // at the ends
    double nearest_z = 0, farthest_z = 0;                        // of this piece of glass, lens coordinates
    bool holds_stop = false;                                     // a stop is inside this glass
  };
  struct Found {
    double distance;
    int surface;  // from surfaces_.size() on: edges; kAbsorbed, kNothing
    Vec3 normal;  // of edges
    Vec3 outward;
  };
  static Normal outward_at_rim(const Face& face, double sign);
  static Normal halfway(const Normal& a, const Normal& b);
  void add_body(const Element& element, std::size_t face, const Motion& placement);
  // Distance to the next face in sequence; false if the ray misses its clear aperture.
  static bool intersect(const Surface& surface, const WalkingRay& ray, double& distance);
  static bool intersect_again(const Surface& surface, const WalkingRay& ray, double& distance);
  // These keep the nearest hit in `found`; a line has up to two with a face.
  static void nearest_on_face(const Surface& surface, int number, const WalkingRay& ray, Found& found);
  static void nearest_on_edge(const Edge& edge, int number, const WalkingRay& ray, Found& found);
  static void nearest_on_stop(const Surface& stop, const WalkingRay& ray, Found& found);
  void nearest_on_barrel(const WalkingRay& ray, Found& found) const;
  Next search(WalkingRay& ray, AtFace& met) const;
  static bool out_of_reach(const Edge& edge, const WalkingRay& ray, double distance);
  bool meets_stop_in_glass(const WalkingRay& ray, double distance) const;
  Next arrive(int number, const WalkingRay& ray, double distance, AtFace& met) const;
  static void weigh(double ratio, const WalkingRay& ray, AtFace& met);
  bool in_bore(const Vec3& at, const Vec3& direction) const;
  static void leave_edge(const Edge& edge, const AtFace& met, WalkingRay& ray);
  const Edge* edge_of(int surface) const;

  std::vector<Surface> surfaces_;  // from the object side
  std::vector<Edge> edges_;
  std::vector<int> stops_;
  std::vector<GlassBody> bodies_;
  bool has_barrel_ = false;
  double bore_radius2_ = 0, front_z_ = 0, rim_z_ = 0;  // of the barrel
};

}  // namespace relign::optics
