// Merits by field, as camera lines use them: from the slanted edges of a capture alone (images/edge_fields.h), for
// scenes that describe "fields".
#pragma once

#include <limits>
#include <string>

#include "images/edge_fields.h"
#include "trials/protocol.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// merit = mtf: how far the worst field is below its limit, at least 0; "centre" applies to the field of that name,
// "corner" to all others. Without limits: 1 minus the lowest MTF at a quarter of the Nyquist frequency, at least 0. The
// MTF is that of the capture divided by the pixel's, sinc(frequency x pitch). An edge that cannot be measured has MTF
// 0.
// merit = edge_energy: r / (r + c) with the edge energies of reference r and capture c: 0.5 where the capture is as
// sharp as the reference, towards 1 with blur, 1 without edges.
class FieldMerit {
 public:
  // `scene` must outlive it. Throws Error(bad_input), see field_merit_mistake, or plugin_failed if the reference image
  // shows no edges.
  FieldMerit(Merit merit, const MtfLimits& limits, const SceneFacts& scene, const images::View& reference);
  // `fields`: those of the scene, with what the capture shows of them.
  double of(const images::View& capture, const images::EdgeFields& fields) const;

 private:
  double mtf_of(const images::FieldEdges& edges) const;

  Merit merit_;
  MtfLimits limits_;
  const SceneFacts& scene_;
  double cycles_per_pixel_ = 0, pixel_mtf_ = 1;
  double reference_energy_ = 0;
};

// Why the scene does not allow the merit; empty if it does.
std::string field_merit_mistake(Merit merit, const MtfLimits& limits, const SceneFacts& scene);

}  // namespace relign::trials
