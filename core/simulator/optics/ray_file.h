// Rays and traces as JSON: {"rays": [{"elements": {...}, "start_mm": [...], "direction": [...]}]} in,
// the same with "hits_mm", "image_mm", "exit_direction" (or "lost_at") out. The format of the golden
// rays.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "optics/assembly.h"
#include "optics/trace.h"

namespace relign::optics {

struct RayRequest {
  std::map<std::string, ElementOffset> elements;
  Ray ray;
};

// Throws Error(bad_input) that lists every mistake. Ignores the members that traced_to_json() adds.
std::vector<RayRequest> read_rays(const JsonSource& source, const Prescription& lens);

Json traced_to_json(const RayRequest& request, const TracedRay& traced);

}  // namespace relign::optics
