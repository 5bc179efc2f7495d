// Where things stand in the drawing of a lens: scale, extents, labels that do not overlap.
#pragma once

#include <string>
#include <vector>

#include "drawing/lens_drawing.h"

namespace relign::drawing {

inline constexpr double kMargin = 24;

struct LensLayout {
  explicit LensLayout(const LensPicture& picture);

  // The place of (z, y) of the lens, both mm.
  Point at(double z_mm, double y_mm) const;
  // Rays begin on the picture's near side, or at the object point if that is nearer.
  optics::Vec3 seen_start(const optics::FanRay& ray) const;

  struct Label {
    Point from, to;  // its leader
    Point at;
    std::string text;
    Anchor anchor = Anchor::middle;
    bool quiet = false;
  };
  std::vector<Label> labels;

  double width = 0, height = 0;
  double pixels_per_mm = 1;
  double bar_mm = 1;                   // of the scale bar
  double low_z_mm = 0, high_z_mm = 0;  // what is seen
  double low_y_mm = 0, high_y_mm = 0;
  double glass_y_mm = 0;       // lens, mount and image lie within, on both sides of the axis
  double ray_z_mm = 0;         // where rays from farther away begin
  double mount_radius_mm = 0;  // its outside
  double stop_outside(const optics::Stop& stop) const;
  double image_low_mm = 0, image_high_mm = 0;

 private:
  struct Mark {
    double z_mm, y_mm;  // what the label belongs to
    std::string text;
  };
  void measure(const LensPicture& picture);
  void add_labels(const std::vector<Mark>& marks, bool above, bool quiet);

  const optics::Assembly* assembly_;
  double widest_ = 0;  // clear radius
  bool vertical_ = false;
  Point origin_;  // of z = 0, y = 0
};

}  // namespace relign::drawing
