#include "optics/assembly.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/text.h"

namespace relign::optics {
namespace {

std::vector<std::string> element_names(const Prescription& lens) {
  std::vector<std::string> names;
  for (const Element& element : lens.elements) names.push_back(element.name);
  return names;
}

}  // namespace

Assembly::Assembly(const Prescription& lens) : Assembly(lens, {}) {}

Assembly::Assembly(const Prescription& lens, const std::map<std::string, ElementOffset>& offsets) : lens_(&lens) {
  for (const Element& element : lens.elements) placements_.push_back(element.placement);
  const Vec3 pivot{0, 0, lens.pivot_z_mm};
  for (const auto& [name, offset] : offsets) {
    const Element* element = lens.element(name);
    if (!element)
      throw Error(ErrorKind::bad_input,
                  "the lens '" + lens.name + "' has no element '" + name + "'" + suggestion(name, element_names(lens)));
    Motion& placement = placements_[static_cast<std::size_t>(element - lens.elements.data())];
    const Motion off = about(pivot, offset.tilt_deg, {offset.shift_mm[0], offset.shift_mm[1], offset.shift_mm[2]});
    placement = placement.is_identity() ? off : after(off, placement);
  }
  find_bounds();
}

void Assembly::find_bounds() {
  for (const Element& element : lens_->elements) {
    polynomials_.emplace_back(element.faces.size());
    for (std::size_t f = 0; f < element.faces.size(); ++f) {
      const Face& face = element.faces[f];
      if (!face.is_conic())
        polynomials_.back()[f] = {bounds_of(face, face.clear_radius_mm), bounds_of(face, valid_radius(face))};
    }
  }
}

Assembly Assembly::placed(const Prescription& lens, std::vector<Motion> placements) {
  Assembly assembly(lens);
  assembly.placements_ = std::move(placements);
  return assembly;
}

std::map<std::string, ElementOffset> read_offsets(const JsonSource& source, const std::string& pointer,
                                                  const Prescription& lens) {
  std::vector<Problem> problems;
  std::map<std::string, ElementOffset> offsets;
  ObjectReader all(source, pointer, problems);
  for (const std::string& name : element_names(lens)) {
    if (!all.get(name)) continue;
    ObjectReader one(source, all.pointer_to(name), problems);
    ElementOffset offset;
    offset.shift_mm = one.numbers("shift_mm", 3, offset.shift_mm);
    offset.tilt_deg = one.numbers("tilt_deg", 2, offset.tilt_deg);
    for (const double tilt : offset.tilt_deg)
      if (!(tilt >= -90 && tilt <= 90))
        one.complain("tilt_deg", "expected tilts from -90 to 90 degrees, found " + shortest(tilt));
    one.reject_unknown();
    offsets[name] = offset;
  }
  all.reject_unknown();
  throw_if_any(problems);
  return offsets;
}

}  // namespace relign::optics
