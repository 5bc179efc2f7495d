// Builds the mesh of a lens element, for 'lens export-mesh'.
#pragma once

#include "meshes/mesh.h"
#include "optics/prescription.h"

namespace relign::meshes {

// A closed mesh in lens coordinates: both faces within their semi-diameters, in rings `pitch_mm` apart along the face
// with corners as far apart on each; between the rims a cone, or a cylinder with a plane ring if a cone would cut a
// face. Throws Error(bad_input) for elements with more than two faces or off the axis, and for too many triangles.
Mesh element_mesh(const optics::Element& element, double pitch_mm);

// Throws Error(bad_input) for elements that the design places off the axis.
void check_on_axis(const optics::Element& element);

}  // namespace relign::meshes
