// Completes a draft by ray tracing: the stop's opening from the system aperture, semi-diameters that the file does not
// state, the image plane, the field. The result is a lens that optics reads.
#pragma once

#include "lens_files/lens_writer.h"
#include "optics/prescription.h"

namespace relign::lens_files {

struct CompleteLens {
  OrderedJson json;  // lens.json
  optics::Prescription lens;
  std::string opening_reason;  // how the opening of the stop was determined, for readers
};

// Adds a remark to the design for every assumption. Throws Error(bad_input) with the design's file and line for
// impossible lenses: faces that cross, semi-diameters larger than a sphere, a stop wider than its lens.
CompleteLens complete_lens(LensDesign& design, LensDraft draft);

// Lens file text for readers: one key per line, lists of numbers on one line.
std::string pretty(const OrderedJson& json);

}  // namespace relign::lens_files
