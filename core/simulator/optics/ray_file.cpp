#include "optics/ray_file.h"

#include <cmath>

namespace relign::optics {
namespace {

Json to_json(const Vec3& v) { return Json::array({v.x, v.y, v.z}); }

Vec3 to_vector(const std::vector<double>& values) { return {values[0], values[1], values[2]}; }

}  // namespace

std::vector<RayRequest> read_rays(const JsonSource& source, const Prescription& lens) {
  std::vector<Problem> problems;
  std::vector<RayRequest> requests;
  ObjectReader top(source, "", problems);
  const Json* rays = top.get("rays");
  if (!rays || !rays->is_array()) {
    top.complain("", "expected {\"rays\": [{\"start_mm\": [x, y, z], \"direction\": [x, y, z]}, ...]}");
    throw_if_any(problems);
  }
  for (std::size_t i = 0; i < rays->size(); ++i) {
    ObjectReader reader(source, "/rays/" + std::to_string(i), problems);
    RayRequest request;
    for (const char* key : {"start_mm", "direction"})
      if (!reader.has(key)) reader.complain_missing(key, "three numbers");
    request.ray.start = to_vector(reader.numbers("start_mm", 3, {0, 0, 0}));
    request.ray.direction = to_vector(reader.numbers("direction", 3, {0, 0, 1}));
    if (!(dot(request.ray.direction, request.ray.direction) > 0))
      reader.complain("direction", "the direction must not be zero");
    for (const char* ignored : {"hits_mm", "image_mm", "exit_direction", "lost_at"}) reader.get(ignored);
    if (reader.get("elements")) {
      try {
        request.elements = read_offsets(source, reader.pointer_to("elements"), lens);
      } catch (const Error& error) {
        reader.complain("elements", error.what());
      }
    }
    reader.reject_unknown();
    requests.push_back(request);
  }
  throw_if_any(problems);
  return requests;
}

Json traced_to_json(const RayRequest& request, const TracedRay& traced) {
  Json elements = Json::object();
  for (const auto& [name, offset] : request.elements)
    elements[name] = {{"tilt_deg", offset.tilt_deg}, {"shift_mm", offset.shift_mm}};
  Json hits = Json::array();
  for (const Vec3& hit : traced.hits) hits.push_back(to_json(hit));
  Json json = {{"elements", elements},
               {"start_mm", to_json(request.ray.start)},
               {"direction", to_json(request.ray.direction)},
               {"hits_mm", hits}};
  if (traced.passed) {
    json["image_mm"] = to_json(traced.image);
    json["exit_direction"] = to_json(traced.exit_direction);
  } else {
    json["lost_at"] = traced.lost_at;
  }
  return json;
}

}  // namespace relign::optics
