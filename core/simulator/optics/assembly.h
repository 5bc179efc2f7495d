// A lens as built: every element is slightly displaced and tilted, as a rigid body.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "optics/face_shape.h"
#include "optics/prescription.h"
#include "optics/rigid.h"

namespace relign::optics {

// p_lens = pivot + Rx(rx) Ry(ry) (p_element - pivot) + shift, right-handed; the pivot is the prescription's, on the
// axis. Applied after the element's placement in the design.
struct ElementOffset {
  std::vector<double> shift_mm = {0, 0, 0};
  std::vector<double> tilt_deg = {0, 0};
};

class Assembly {
 public:
  // The perfect lens.
  explicit Assembly(const Prescription& lens);
  // Throws Error(bad_input) for an unknown element.
  Assembly(const Prescription& lens, const std::map<std::string, ElementOffset>& offsets);

  // With the given placements, which map element to lens coordinates: for motions that no ElementOffset describes.
  static Assembly placed(const Prescription& lens, std::vector<Motion> placements);

  const Prescription& lens() const { return *lens_; }
  // Maps element coordinates (those of the undisturbed lens) to lens coordinates.
  const Motion& placement(std::size_t element) const { return placements_[element]; }
  // Of a polynomial face: within its semi-diameter (Apertures::mesh), else within valid_radius(). Empty for conics.
  const FaceBounds& bounds(std::size_t element, std::size_t face, Apertures apertures) const {
    const PolynomialFace& own = polynomials_[element][face];
    return apertures == Apertures::mesh ? own.clear : own.valid;
  }

 private:
  struct PolynomialFace {
    FaceBounds clear, valid;
  };

  void find_bounds();

  const Prescription* lens_;
  std::vector<Motion> placements_;
  std::vector<std::vector<PolynomialFace>> polynomials_;  // by element and face
};

// {"L2": {"tilt_deg": [rx, ry], "shift_mm": [x, y, z]}, ...} at `pointer` of a file or text.
// Throws Error(bad_input) listing every mistake.
std::map<std::string, ElementOffset> read_offsets(const JsonSource& source, const std::string& pointer,
                                                  const Prescription& lens);

}  // namespace relign::optics
