// Layout of the drawing of a lens: scale, extents, labels that do not overlap.
#pragma once

#include <string>
#include <vector>

#include "lens_drawing/lens_drawing.h"

namespace relign::drawing {

inline constexpr double kMargin = 24;

struct LensLayout {
  explicit LensLayout(const LensPicture& picture);

  // Position in the picture of (z, y) of the lens, mm.
  Point at(double z_mm, double y_mm) const;
  // Start of a ray in the picture: on its object side, or at the object point if that is closer.
  optics::Vec3 drawn_start(const optics::FanRay& ray) const;

  struct Label {
    Point from, to;  // leader line
    Point at;
    std::string text;
    Anchor anchor = Anchor::middle;
    bool quiet = false;
  };
  std::vector<Label> labels;

  double width = 0, height = 0;
  double pixels_per_mm = 1;
  double bar_mm = 1;                   // of the scale bar
  double low_z_mm = 0, high_z_mm = 0;  // visible range
  double low_y_mm = 0, high_y_mm = 0;
  double glass_y_mm = 0;        // lens, barrel and image are within, on both sides of the axis
  double ray_z_mm = 0;          // start of rays from farther away
  double barrel_radius_mm = 0;  // outer
  double stop_outer_radius(const optics::Stop& stop) const;
  double image_low_mm = 0, image_high_mm = 0;

 private:
  struct Mark {
    double z_mm, y_mm;  // labelled point
    std::string text;
  };
  void measure(const LensPicture& picture);
  void add_labels(const std::vector<Mark>& marks, bool above, bool quiet);

  const optics::Assembly* assembly_;
  double widest_ = 0;  // semi-diameter
  bool vertical_ = false;
  Point origin_;  // of z = 0, y = 0
};

}  // namespace relign::drawing
