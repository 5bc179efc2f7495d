// The fields of a scene whose target is a grid of slightly rotated squares (slanted_edges, camera_chart): which squares
// the design shows where on the sensor, and which of their edges to measure.
#pragma once

#include <vector>

#include "images/edge_fields.h"
#include "imaging/field_mtf.h"
#include "imaging/scene_file.h"

namespace relign::imaging {

// The middle of an edge on the emitter.
struct ChartEdge {
  double x_mm = 0, y_mm = 0;
  double normal_x = 0, normal_y = 0;  // unit
};

struct ChartField {
  images::EdgeField field;
  double x_mm = 0, y_mm = 0;  // of the square's centre on the emitter
  ChartEdge tangential, sagittal;
};

// Up to 13: at the centre, and at 0.8 of the way from there to the sides and the corners of the sensor and 0.45 of the
// way to its corners the nearest square whose measured edges are on the sensor. Places are those of the design's chief
// rays at the nominal pose. Of a square's edges those nearer to the centre are measured, "tangential" being the one
// whose normal is nearer to the radial direction; in the centre itself, to the rows. Regions have at most 128 x 128
// pixels. Empty for other targets, and where the squares have fewer than 40 pixels a side.
std::vector<ChartField> chart_fields(const SceneFile& scene);

// A window around each field: `pixels` a side around its mark, or as many as its mark and regions need, in whole tiles
// and inside the sensor. Throws Error(bad_input) for a scene without fields.
std::vector<PixelBox> windows_around_fields(const SceneFile& scene, int pixels);

// Those that the scene file lists, else those of the chart.
images::EdgeFields fields_of(const SceneFile& scene);

// Their points as the ability "fields" of scene.toml defines them, in the same order. Throws Error(bad_input) for a
// listed field that the design does not image.
std::vector<FieldPoint> points_of_fields(const SceneFile& scene);

}  // namespace relign::imaging
