// The checked description of a scene: the JSON of relign_scene_interface::describe.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "base/pixel_region.h"
#include "base/scene_score.h"
#include "base/shared_keys.h"
#include "images/edge_fields.h"
#include "images/image.h"

namespace relign::trials {

struct Axis {
  std::string name;        // "x", "Rx"
  std::string unit;        // "mm", "deg" or any other
  double lower = 0;        // physical value at pose 0
  double upper = 0;        // physical value at pose 1
  bool observable = true;  // a misalignment along it changes the image of the design
  double speed_per_s = 0;  // in its unit; 0: as the machine time says for mm or degrees
  double travel() const { return upper - lower; }
};

// What of a lens or a device as built is uncertain, besides the places of its elements.
struct UncertainQuantity {
  std::string name;  // as none of the elements
  std::string unit;
};

// Simulated machine time of one step: travel (all axes at once, the slowest one counts), settling,
// exposure, readout.
struct MachineTime {
  double speed_mm_per_s = 5;
  double speed_deg_per_s = 5;
  double settle_ms = 40;
  double exposure_ms = 15;
  double readout_ms = 30;
};

// Sets what a capture of these regions shows of the scene's fields: `shown` has the same fields. A field with a mark is
// measured inside one region, that which contains most of the mark, and others only if a region contains them.
void show_regions(const PixelRegions& regions, const images::EdgeFields& fields, images::EdgeFields& shown);

// `times` with the members that are given replaced.
MachineTime changed_by(const MachineTimeKeys& given, MachineTime times);

struct SceneFacts {
  std::string name;
  std::string summary;
  std::vector<Axis> axes;
  std::vector<double> nominal_pose;
  unsigned image_width = 0;
  unsigned image_height = 0;
  double image_white = 1;     // display value of a lit pixel
  double pitch_um = 0;        // of the pixels; 0: unknown
  images::EdgeFields fields;  // places with slanted edges; may be empty
  std::vector<std::string> elements;
  std::vector<UncertainQuantity> uncertain;
  // They begin the last line of a capture, a pixel each, which is its only one in a scene without an image.
  std::vector<Reading> readings;
  SceneScore score;
  MachineTime machine_time;
  Json spec;                       // as in the description, null when absent
  std::vector<std::string> files;  // data files the image depends on
  bool owns_stage = false;         // a station: relative moves, no W, no true pose
  bool truth = true;               // the scene computes noise-free errors
  // Whether the harness is to search for the best pose of an instance; otherwise only the scene does, if it can.
  bool searches_optimum = false;
  std::string text;                          // the description verbatim
  std::optional<std::size_t> score_measure;  // reading or pixel that measures the score; without it, the RMSE does

  // The name of the reading that measures the score, which has a measure.
  const std::string& score_reading() const { return readings[*score_measure % image_width].name; }
  std::vector<std::size_t> observable_axes() const;
  bool has_image() const { return image_height > (readings.empty() ? 0U : 1U); }
  // Rows of a capture's picture (picture_of).
  unsigned picture_height() const { return has_image() && !readings.empty() ? image_height - 1 : image_height; }

  // What a capture measures of the score, noise included; not finite where a pixel is not. Both have all pixels.
  double measured(const float* pixels, const float* reference) const;
};

// The image of a capture, which has all pixels, without the line of readings; all of it in a scene without an image.
images::Image picture_of(const SceneFacts& facts, const float* capture);

// Throws Error(plugin_failed) that lists every mistake in the description. A station may omit
// nominal_pose (default 0.5) and elements.
SceneFacts read_scene_facts(const std::string& description, const std::string& scene_id);

}  // namespace relign::trials
