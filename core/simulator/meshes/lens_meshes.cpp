#include "meshes/lens_meshes.h"

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/text.h"
#include "meshes/mesh_writer.h"
#include "meshes/traced_mesh.h"
#include "optics/backward_path.h"

namespace relign::meshes {
namespace {

// Least distance between consecutive hits: above the rounding of Embree's floats.
constexpr double kMinStep = 1e-4;  // mm
constexpr std::size_t kMaxBodies = 32;
constexpr int kMaxFaces = 64;  // per ray; a ray with more hits is trapped between faces

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

struct LensMeshes::Body {
  TracedMesh mesh;
  double index = 0;         // 0: absorbs
  std::size_t element = 0;  // of the prescription; unused if absorbing
  optics::Motion into;      // lens to element coordinates
};

struct LensMeshes::Hit {
  double distance = kInfinity;
  const Body* body = nullptr;
  bool entering = false;
  Vec3 at, normal;  // lens coordinates; the normal unit and outwards
};

LensMeshes::LensMeshes(const optics::Prescription& lens, const std::map<std::string, Mesh>& meshes)
    : device_(std::make_unique<EmbreeDevice>()), stops_(lens.stops) {
  std::vector<std::string> known;
  if (lens.barrel) {
    barrel_ = *lens.barrel;
    has_bore_ = true;
  }
  const auto add = [&](const std::string& name, double index, std::size_t element) {
    known.push_back(name);
    const auto found = meshes.find(name);
    if (found == meshes.end()) return false;
    bodies_.push_back({TracedMesh(*device_, found->second, index > 0), index, element, {}});
    return true;
  };
  for (std::size_t e = 0; e < lens.elements.size(); ++e) {
    const optics::Element& element = lens.elements[e];
    if (element.faces.size() != 2)
      throw Error(ErrorKind::bad_input, "element " + element.name + " has " + counted(element.faces.size(), "face") +
                                            "; lenses of meshes need elements with two");
    check_on_axis(element);
    if (!add(element.name, element.faces[0].index_after, e))
      throw Error(ErrorKind::bad_input, "missing mesh of element '" + element.name + "'");
  }
  stops_.erase(
      std::remove_if(stops_.begin(), stops_.end(), [&](const optics::Stop& stop) { return add(stop.name, 0, 0); }),
      stops_.end());
  if (add("mount", 0, 0)) has_bore_ = false;
  for (const auto& [name, mesh] : meshes)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw Error(ErrorKind::bad_input,
                  "unknown mesh '" + name + "'; expected an element or stop of the lens" + suggestion(name, known));
  if (bodies_.size() > kMaxBodies)
    throw Error(ErrorKind::bad_input, "the lens has " + std::to_string(bodies_.size()) + " meshes; allowed are up to " +
                                          std::to_string(kMaxBodies));
  place(optics::Assembly(lens), {}, {});
}

LensMeshes::~LensMeshes() = default;

void LensMeshes::place(const optics::Assembly& assembly, const optics::Motion& lens_to_world,
                       const optics::BackwardPath& path) {
  for (Body& body : bodies_)
    if (body.index > 0) body.into = optics::inverse(assembly.placement(body.element));
  lens_to_world_ = lens_to_world;
  first_frame_to_lens_ = optics::after(optics::inverse(lens_to_world), optics::inverse(path.into_first_frame));
}

bool LensMeshes::nearest_hit(const Vec3& at, const Vec3& direction, bool from_start, Hit& hit) const {
  hit = {};
  const double from = from_start ? 0 : kMinStep;
  // Nearest box first: most rays need one tree only.
  struct Candidate {
    const Body* body;
    double entry;
    Vec3 start, direction;  // in element coordinates
  };
  Candidate candidates[kMaxBodies];
  std::size_t count = 0;
  for (const Body& body : bodies_) {
    const Vec3 start = body.into.point(at), along = body.into.direction(direction);
    const double entry = body.mesh.box_entry(start, along);
    if (entry == kInfinity) continue;
    std::size_t place = count++;
    for (; place > 0 && candidates[place - 1].entry > entry; --place) candidates[place] = candidates[place - 1];
    candidates[place] = {&body, entry, start, along};
  }
  for (std::size_t i = 0; i < count && candidates[i].entry < hit.distance; ++i) {
    const Body& body = *candidates[i].body;
    SurfacePoint point;
    if (!body.mesh.nearest(candidates[i].start, candidates[i].direction, from, hit.distance, point)) continue;
    hit.distance = point.distance;
    hit.body = &body;
    hit.entering = point.entering;
    const optics::Rotation back = optics::transposed(body.into.rotation);
    hit.normal = optics::turn(back, point.normal);
    hit.at = optics::turn(back, point.at - body.into.translation);
  }
  return hit.body != nullptr;
}

// Stops and barrel of the prescription: planes with an opening, a bore with a rear rim.
bool LensMeshes::absorbed_before(const Vec3& at, const Vec3& direction, double reach) const {
  const auto radius2 = [&](double t) {
    const double x = at.x + t * direction.x, y = at.y + t * direction.y;
    return x * x + y * y;
  };
  const auto beside = [&](double z, double opening) {
    const double t = (z - at.z) / direction.z;
    return t > 0 && t < reach && radius2(t) > opening * opening;
  };
  for (const optics::Stop& stop : stops_)
    if (beside(stop.z_mm, stop.opening_radius_mm)) return true;
  if (!has_bore_) return false;
  const double bore2 = barrel_.bore_radius_mm * barrel_.bore_radius_mm;
  if (beside(barrel_.to_z_mm, barrel_.bore_radius_mm)) return true;
  // Where the line leaves the bore's cylinder.
  const double a = direction.x * direction.x + direction.y * direction.y;
  const double b = at.x * direction.x + at.y * direction.y;
  const double discriminant = b * b - a * (at.x * at.x + at.y * at.y - bore2);
  if (a <= 0 || discriminant < 0) return false;
  const double t = (-b + std::sqrt(discriminant)) / a;
  const double z = at.z + t * direction.z;
  return t > 0 && t < reach && z > barrel_.from_z_mm && z < barrel_.to_z_mm;
}

LensMeshes::Passed LensMeshes::trace_ray(const Vec3& start, const Vec3& start_direction, bool fresnel) const {
  Passed ray;
  ray.at = start;
  ray.direction = start_direction;
  for (; ray.faces < kMaxFaces; ++ray.faces) {
    Hit hit;
    const bool met = nearest_hit(ray.at, ray.direction, ray.faces == 0, hit);
    if (absorbed_before(ray.at, ray.direction, hit.distance)) return ray;
    if (!met) {
      ray.passed = true;
      return ray;
    }
    if (hit.body->index == 0) return ray;
    const double ratio = hit.entering ? 1 / hit.body->index : hit.body->index;  // index before over index after
    const Vec3 normal = hit.entering ? -1.0 * hit.normal : hit.normal;          // along the ray
    const double cosine = dot(normal, ray.direction);
    const double refracted2 = 1 - ratio * ratio * (1 - cosine * cosine);
    if (!(refracted2 > 0)) return ray;
    const double refracted = std::sqrt(refracted2);
    if (fresnel) {
      const double s = (ratio * cosine - refracted) / (ratio * cosine + refracted);
      const double p = (cosine - ratio * refracted) / (cosine + ratio * refracted);
      ray.transmittance *= 1 - 0.5 * (s * s + p * p);
    }
    ray.direction = unit(ratio * ray.direction + (refracted - ratio * cosine) * normal);
    ray.at = hit.at;
  }
  return ray;
}

void LensMeshes::trace(optics::RayBlock& block, bool fresnel, int count) const {
  for (int i = 0; i < count; ++i) {
    if (!(block.margin[i] > 0)) continue;  // started outside the disc of directions
    const auto number = [](float value) { return static_cast<double>(value); };
    const Vec3 start = first_frame_to_lens_.point({number(block.x[i]), number(block.y[i]), number(block.z[i])});
    const Vec3 direction =
        unit(first_frame_to_lens_.direction({number(block.lx[i]), number(block.ly[i]), number(block.lz[i])}));
    const Passed ray = trace_ray(start, direction, fresnel);
    const Vec3 along = lens_to_world_.direction(ray.direction);
    optics::put_ray(block, i, lens_to_world_.point(ray.at), along);
    block.above[i] = static_cast<float>(ray.transmittance);
    // The emitter is in the direction -z.
    block.margin[i] = ray.passed && along.z < 0 ? 1.0F : -1.0F;
  }
}

}  // namespace relign::meshes
