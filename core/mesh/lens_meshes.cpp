#include "mesh/lens_meshes.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "base/error.h"
#include "base/text.h"
#include "mesh/smooth.h"

namespace relign::mesh {
namespace {

// Rays leave a face for another one that is at least so far away: above the rounding of Embree's floats.
constexpr double kLeastStep = 1e-4;  // mm
constexpr int kMostFaces = 64;       // met by one ray; whoever meets more is caught between faces

struct RayBox {
  double near = 0, far = 0;
};

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Embree's failures, in words.
[[noreturn]] void embree_failed(RTCDevice device) {
  const RTCError code = rtcGetDeviceError(device);
  throw Error(ErrorKind::internal, "Embree failed with code " + std::to_string(static_cast<int>(code)) +
                                       (code == RTC_ERROR_OUT_OF_MEMORY ? ": out of memory" : ""));
}

}  // namespace

struct LensMeshes::Device {
  // One thread builds: the trees, and so the images, do not depend on the machine's load.
  Device() : handle(rtcNewDevice("threads=1,set_affinity=0")) {
    if (!handle) embree_failed(nullptr);
  }
  ~Device() { rtcReleaseDevice(handle); }
  RTCDevice handle;
};

// One mesh with all that rays need of it. Embree's copy lies around its middle, where floats are finer.
struct LensMeshes::Body {
  Mesh mesh;
  CornerNormals normals;
  double index = 0;         // 0: absorbs
  std::size_t element = 0;  // of the prescription; unused by what absorbs
  Vec3 low, high, middle;   // of the box around it
  RTCScene scene = nullptr;
  optics::Motion into;  // lens to element coordinates

  Body() = default;
  Body(Body&& other) noexcept { *this = std::move(other); }
  Body& operator=(Body&& other) noexcept {
    mesh = std::move(other.mesh);
    normals = std::move(other.normals);
    index = other.index;
    element = other.element;
    low = other.low;
    high = other.high;
    middle = other.middle;
    into = other.into;
    std::swap(scene, other.scene);
    return *this;
  }
  ~Body() {
    if (scene) rtcReleaseScene(scene);
  }

  void build(RTCDevice device) {
    low = {kInfinity, kInfinity, kInfinity};
    high = {-kInfinity, -kInfinity, -kInfinity};
    for (const Vec3& v : mesh.vertices) {
      low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
      high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
    }
    middle = 0.5 * (low + high);
    constexpr double kWider = 1e-5;  // than the mesh: a box without depth still has an inside
    low = low - Vec3{kWider, kWider, kWider};
    high = high + Vec3{kWider, kWider, kWider};

    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* const vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    auto* const indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), mesh.triangles.size()));
    if (!vertices || !indices) embree_failed(device);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const Vec3 p = mesh.vertices[v] - middle;
      vertices[3 * v] = static_cast<float>(p.x);
      vertices[3 * v + 1] = static_cast<float>(p.y);
      vertices[3 * v + 2] = static_cast<float>(p.z);
    }
    std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
    rtcCommitGeometry(geometry);
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips between two triangles
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) embree_failed(device);
  }

  // Where the line is inside the box.
  RayBox clip(const Vec3& p, const Vec3& d) const {
    RayBox box{-kInfinity, kInfinity};
    const auto axis = [&](double at, double along, double least, double most) {
      if (along == 0) {
        if (at < least || at > most) box.near = kInfinity;
        return;
      }
      const double a = (least - at) / along, b = (most - at) / along;
      box.near = std::max(box.near, std::min(a, b));
      box.far = std::min(box.far, std::max(a, b));
    };
    axis(p.x, d.x, low.x, high.x);
    axis(p.y, d.y, low.y, high.y);
    axis(p.z, d.z, low.z, high.z);
    return box;
  }

  // The nearest triangle between two distances, in element coordinates; false without one.
  bool nearest(const Vec3& p, const Vec3& d, double from, double to, std::uint32_t& triangle) const {
    const RayBox box = clip(p, d);
    if (box.near > std::min(box.far, to) || box.far < from) return false;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit query{};
    const Vec3 start = p - middle;
    query.ray.org_x = static_cast<float>(start.x);
    query.ray.org_y = static_cast<float>(start.y);
    query.ray.org_z = static_cast<float>(start.z);
    query.ray.dir_x = static_cast<float>(d.x);
    query.ray.dir_y = static_cast<float>(d.y);
    query.ray.dir_z = static_cast<float>(d.z);
    query.ray.tnear = static_cast<float>(from);
    query.ray.tfar = static_cast<float>(std::min(to, box.far + 1));
    query.ray.mask = 0xffffffffU;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &query);
    triangle = query.hit.primID;
    return query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }
};

struct LensMeshes::Hit {
  double distance = kInfinity;
  const Body* body = nullptr;
  bool entering = false;
  Vec3 at, normal;  // lens coordinates; the normal unit and outwards
};

LensMeshes::LensMeshes(const optics::Prescription& lens, const std::map<std::string, Mesh>& meshes)
    : device_(std::make_unique<Device>()), stops_(lens.stops) {
  std::vector<std::string> known;
  if (lens.mount) {
    mount_ = *lens.mount;
    has_bore_ = true;
  }
  const auto add = [&](const std::string& name, double index, std::size_t element) {
    known.push_back(name);
    const auto found = meshes.find(name);
    if (found == meshes.end()) return false;
    Body body;
    body.mesh = found->second;
    if (index > 0) body.normals = corner_normals(body.mesh);
    body.index = index;
    body.element = element;
    body.build(device_->handle);
    bodies_.push_back(std::move(body));
    return true;
  };
  for (std::size_t e = 0; e < lens.elements.size(); ++e) {
    const optics::Element& element = lens.elements[e];
    if (element.faces.size() != 2)
      throw Error(ErrorKind::bad_input, "element " + element.name + " has " + std::to_string(element.faces.size()) +
                                            " faces: lenses of meshes are made of elements with two");
    if (!add(element.name, element.faces[0].index_after, e))
      throw Error(ErrorKind::bad_input, "there is no mesh of the element " + element.name);
  }
  stops_.erase(
      std::remove_if(stops_.begin(), stops_.end(), [&](const optics::Stop& stop) { return add(stop.name, 0, 0); }),
      stops_.end());
  if (add("mount", 0, 0)) has_bore_ = false;
  for (const auto& [name, mesh] : meshes)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw Error(ErrorKind::bad_input,
                  "a mesh is named '" + name + "', which is no element or stop of the lens" + suggestion(name, known));
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
  const double from = from_start ? 0 : kLeastStep;
  for (const Body& body : bodies_) {
    const Vec3 p = body.into.point(at), d = body.into.direction(direction);
    std::uint32_t triangle = 0;
    if (!body.nearest(p, d, from, hit.distance, triangle)) continue;
    // Embree tells which triangle; where on it, in double.
    const Vec3 &v0 = body.mesh.corner(triangle, 0), edge1 = body.mesh.corner(triangle, 1) - v0,
               edge2 = body.mesh.corner(triangle, 2) - v0;
    const Vec3 facet = cross(edge1, edge2);
    const double along = dot(facet, d);
    if (along == 0) continue;
    const double distance = dot(v0 - p, facet) / along;
    if (distance >= hit.distance) continue;
    hit.distance = distance;
    hit.body = &body;
    if (body.index == 0) continue;
    const Vec3 place = p + distance * d, q = place - v0;
    const double scale = 1 / dot(facet, facet);
    const double u = scale * dot(cross(q, edge2), facet), v = scale * dot(cross(edge1, q), facet);
    const Triangle& corners = body.normals.corners[triangle];
    Vec3 normal = unit((1 - u - v) * body.normals.normals[corners[0]] + u * body.normals.normals[corners[1]] +
                       v * body.normals.normals[corners[2]]);
    hit.entering = along < 0;
    // Near grazing the smooth surface may look away where the facet does not.
    if ((dot(normal, d) < 0) != hit.entering) normal = unit(facet);
    const optics::Rotation back = optics::transposed(body.into.rotation);
    hit.normal = optics::turn(back, normal);
    hit.at = optics::turn(back, place - body.into.translation);
  }
  return hit.body != nullptr;
}

// What the prescription says of stops and mount: planes with an opening, a bore with a rear rim.
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
  const double bore2 = mount_.bore_radius_mm * mount_.bore_radius_mm;
  if (beside(mount_.to_z_mm, mount_.bore_radius_mm)) return true;
  // Where the line leaves the bore's cylinder.
  const double a = direction.x * direction.x + direction.y * direction.y;
  const double b = at.x * direction.x + at.y * direction.y;
  const double discriminant = b * b - a * (at.x * at.x + at.y * at.y - bore2);
  if (a <= 0 || discriminant < 0) return false;
  const double t = (-b + std::sqrt(discriminant)) / a;
  const double z = at.z + t * direction.z;
  return t > 0 && t < reach && z > mount_.from_z_mm && z < mount_.to_z_mm;
}

LensMeshes::Passed LensMeshes::trace_ray(const Vec3& start, const Vec3& start_direction, bool fresnel) const {
  Passed ray;
  ray.at = start;
  ray.direction = start_direction;
  for (; ray.faces < kMostFaces; ++ray.faces) {
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
    const Vec3 at = lens_to_world_.point(ray.at), along = lens_to_world_.direction(ray.direction);
    block.x[i] = static_cast<float>(at.x);
    block.y[i] = static_cast<float>(at.y);
    block.z[i] = static_cast<float>(at.z);
    block.lx[i] = static_cast<float>(along.x);
    block.ly[i] = static_cast<float>(along.y);
    block.lz[i] = static_cast<float>(along.z);
    block.above[i] = static_cast<float>(ray.transmittance);
    block.below[i] = 1;
    // The emitter lies in the direction -z.
    block.margin[i] = ray.passed && along.z < 0 ? 1.0F : -1.0F;
  }
}

}  // namespace relign::mesh
