// What a design leaves to rays: the stop's opening from the system aperture, clear radii that the file does not tell,
// the image plane, the field. Ends in a lens that optics reads.
#pragma once

#include "lens_files/lens_writer.h"
#include "optics/prescription.h"

namespace relign::lens_files {

struct CompleteLens {
  OrderedJson json;  // lens.json
  optics::Prescription lens;
  std::string opening_why;  // what decided how wide the stop opens, for people
};

// Adds remarks to the design for everything that it had to assume. Throws Error(bad_input) with the design's file and
// line where the lens cannot be: faces that cross, clear radii larger than a sphere, a stop wider than its lens.
CompleteLens complete_lens(LensDesign& design, LensDraft draft);

// Lens file text, for people: one key a line, lists of numbers in one line.
std::string pretty(const OrderedJson& json);

}  // namespace relign::lens_files
