// Lays out a scene around a lens: sensor, emitter, travel, tolerances and a suite, by the rules in docs/lens_files.md.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lens_files/completion.h"
#include "lens_files/sensor_size.h"

namespace relign::lens_files {

struct LayoutChoices {
  std::string name;
  std::string suite_name;               // names its results; empty: name
  std::optional<SensorSize> sensor;     // absent: one that contains the image
  double distance_mm = 0;               // first vertex to emitter; 0: the file's, else by the paper's formula
  std::string target = "siemens_star";  // as written in the scene file
  bool target_is_named = true;          // false: a file
  bool polychromatic = false;           // all wavelengths of the design, with its weights
  bool camera = false;                  // a camera line: methods, budget and cycle of the suite
  Json movement;                        // errors of the stage, as in a tolerance file; null: axes coupled by 1 %
  std::string stage;                    // where they are from
};

// One number of the layout with the reason for it.
struct LayoutLine {
  std::string what;
  std::string value;
  std::string why;
};

struct Layout {
  OrderedJson scene, tolerances, suite;
  std::vector<LayoutLine> lines;
  std::string grade;    // of the tolerances: "10 um, 3 arcmin"
  double pitch_mm = 0;  // of the sensor's pixels
};

// Adds remarks to the design. Throws Error(bad_input) if the lens forms no image.
Layout lay_out(LensDesign& design, const CompleteLens& lens, const LayoutChoices& choices);

// Sets an initial specification: the RMSE of a noise-free image shifted sideways by one pixel, which the caller
// renders. Two digits of it go into the scene file.
void set_specification(Layout& layout, double rmse);

// A camera's electronics: a pixel of this irradiance is at 80 % of the full well.
void set_electronics(Layout& layout, double white);

// The user's specification.
void set_own_specification(Layout& layout, const Json& spec, const std::string& file);

// Sets an initial specification of a camera: MTF by field at a quarter of the Nyquist frequency, at least a share of
// the worst field's at the design's best pose, `reached`. Returns a warning where that is low, else "".
double camera_lp_per_mm(const Layout& layout);
std::string set_camera_specification(Layout& layout, double reached);

// The README.md of the new folder.
std::string readme(const LensDesign& design, const CompleteLens& lens, const LayoutChoices& choices,
                   const Layout& layout);

// "lens.zmx:12: not understood: ... (and 3 lines more)", one line each.
std::vector<std::string> remark_lines(const LensDesign& design);

}  // namespace relign::lens_files
