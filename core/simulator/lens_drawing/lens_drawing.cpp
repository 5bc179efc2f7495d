#include "lens_drawing/lens_drawing.h"

#include <algorithm>
#include <cmath>

#include "drawing/colours.h"
#include "drawing/raster_canvas.h"
#include "drawing/scales.h"
#include "drawing/svg_canvas.h"
#include "lens_drawing/lens_layout.h"
#include "optics/face_shape.h"

namespace relign::drawing {
namespace {

constexpr int kFacePoints = 25;
constexpr Colour kGlass{214, 230, 244};
constexpr Colour kGlassEdge{62, 84, 110};
constexpr Colour kBarrel{176, 180, 186};
constexpr Colour kAxis{150, 156, 164};

using optics::Vec3;

std::vector<Point> on_picture(const LensLayout& layout, const std::vector<Vec3>& places) {
  std::vector<Point> points;
  for (const Vec3& place : places) points.push_back(layout.at(place.z, place.y));
  return points;
}

// Outline of the glass between two faces: the smaller face is extended by a flat rim to the larger semi-diameter, as
// lenses are ground.
std::vector<Vec3> glass_outline(const optics::Face& front, const optics::Face& back, const optics::Motion& placement) {
  std::vector<Vec3> outline = face_section(front, placement, kFacePoints);
  std::vector<Vec3> rear = face_section(back, placement, kFacePoints);
  const double radius = std::max(front.clear_radius_mm, back.clear_radius_mm);
  // Corners in the element's own y-z plane; sections of faces that are tilted about y end slightly outside it.
  const optics::Motion into = optics::inverse(placement);
  const auto widened = [&](const Vec3& end, double y) { return placement.point({0, y, into.point(end).z}); };
  std::reverse(rear.begin(), rear.end());  // starting at the front's upper end
  if (front.clear_radius_mm < radius) {
    outline.insert(outline.begin(), widened(outline.front(), -radius));
    outline.push_back(widened(outline.back(), radius));
  }
  if (back.clear_radius_mm < radius) {
    rear.insert(rear.begin(), widened(rear.front(), radius));
    rear.push_back(widened(rear.back(), -radius));
  }
  outline.insert(outline.end(), rear.begin(), rear.end());
  return outline;
}

void draw_elements(Canvas& canvas, const LensLayout& layout, const optics::Assembly& assembly) {
  const std::vector<optics::Element>& elements = assembly.lens().elements;
  for (std::size_t e = 0; e < elements.size(); ++e) {
    canvas.open_group("element", elements[e].name);
    for (std::size_t f = 0; f + 1 < elements[e].faces.size(); ++f)
      canvas.polygon(
          on_picture(layout, glass_outline(elements[e].faces[f], elements[e].faces[f + 1], assembly.placement(e))),
          kGlass, Stroke{kGlassEdge, 1.2});
    for (const optics::Face& face : elements[e].faces)
      if (face.mirror)
        canvas.polyline(on_picture(layout, face_section(face, assembly.placement(e), kFacePoints)), {kGlassEdge, 3});
    canvas.close_group();
  }
}

void draw_barrel(Canvas& canvas, const LensLayout& layout, const std::optional<optics::Barrel>& barrel) {
  if (!barrel) return;
  canvas.open_group("barrel", "barrel");
  for (const double side : {1.0, -1.0}) {
    const double inner = side * barrel->bore_radius_mm, outer = side * layout.barrel_radius_mm;
    const double from = barrel->from_z_mm, to = barrel->to_z_mm;
    canvas.polygon({layout.at(from, inner), layout.at(to, inner), layout.at(to, outer), layout.at(from, outer)},
                   kBarrel, {});
  }
  canvas.close_group();
}

void draw_stops(Canvas& canvas, const LensLayout& layout, const optics::Prescription& lens) {
  for (const optics::Stop& stop : lens.stops) {
    canvas.open_group("stop", stop.name);
    for (const double side : {1.0, -1.0})
      canvas.polyline({layout.at(stop.z_mm, side * stop.opening_radius_mm),
                       layout.at(stop.z_mm, side * layout.stop_outer_radius(stop))},
                      {kInk, stop.aperture ? 3.5 : 2.0});
    canvas.close_group();
  }
}

void draw_rays(Canvas& canvas, const LensLayout& layout, const LensPicture& picture) {
  for (const DrawnFan& fan : picture.fans) {
    canvas.open_group("rays", fan.label);
    for (const optics::FanRay& ray : fan.rays) {
      std::vector<Vec3> points = {layout.drawn_start(ray)};
      points.insert(points.end(), ray.traced.hits.begin(), ray.traced.hits.end());
      points.push_back(ray.traced.image);
      canvas.polyline(on_picture(layout, points), {series_colour(fan.series), 0.9});
    }
    canvas.close_group();
  }
}

void draw_image_plane(Canvas& canvas, const LensLayout& layout, const LensPicture& picture) {
  const double z = picture.assembly->lens().image_z_mm;
  canvas.open_group("image", picture.sensor_low_mm ? "sensor" : "image plane");
  canvas.polyline({layout.at(z, layout.image_low_mm), layout.at(z, layout.image_high_mm)}, {kInk, 3});
  canvas.close_group();
}

void draw_labels(Canvas& canvas, const LensLayout& layout) {
  for (const LensLayout::Label& label : layout.labels) {
    canvas.segments({{label.from, label.to}}, {kAxis, 0.7});
    canvas.text(label.at, label.text, {12, label.quiet ? kQuietInk : kInk, label.anchor, false, !label.quiet});
  }
}

void draw_heading(Canvas& canvas, const LensLayout& layout, const LensPicture& picture) {
  canvas.text({kMargin, 30}, picture.title, {18, kInk, Anchor::start, false, true});
  canvas.text({kMargin, 50}, picture.subtitle, {12, kQuietInk});
  double x = kMargin;
  for (const DrawnFan& fan : picture.fans) {
    const Colour colour = series_colour(fan.series);
    canvas.segments({{{x, 68}, {x + 22, 68}}}, {colour, 2.5});
    canvas.text({x + 28, 72}, fan.label, {12, kInk});
    x += 28 + text_width(fan.label, 12) + 20;
  }
  const double y = layout.height - kMargin;
  const double right = layout.width - kMargin, left = right - layout.bar_mm * layout.pixels_per_mm;
  canvas.segments({{{left, y}, {right, y}}, {{left, y - 5}, {left, y + 5}}, {{right, y - 5}, {right, y + 5}}},
                  {kInk, 1.5});
  canvas.text({(left + right) / 2, y - 8}, tick_text(layout.bar_mm, layout.bar_mm) + " mm", {12, kInk, Anchor::middle});
}

void draw(Canvas& canvas, const LensLayout& layout, const LensPicture& picture) {
  draw_barrel(canvas, layout, picture.assembly->lens().barrel);
  draw_elements(canvas, layout, *picture.assembly);
  draw_stops(canvas, layout, picture.assembly->lens());
  canvas.open_group("axis", "optical axis");
  canvas.polyline({layout.at(layout.low_z_mm, 0), layout.at(layout.high_z_mm, 0)}, {kAxis, 0.8, true});
  canvas.close_group();
  draw_rays(canvas, layout, picture);
  draw_image_plane(canvas, layout, picture);
  draw_labels(canvas, layout);
  draw_heading(canvas, layout, picture);
}

}  // namespace

std::vector<Vec3> face_section(const optics::Face& face, const optics::Motion& placement, int points) {
  const double radius = face.clear_radius_mm;
  std::vector<Vec3> section;
  for (int i = 0; i < points; ++i) {
    const double share = 2.0 * i / (points - 1) - 1;
    // Finds the element's x at which x of the lens is 0; offsets are small, so that each round reduces the error a
    // hundredfold.
    double x = 0;
    Vec3 place;
    for (int round = 0; round < 12; ++round) {
      const double y = share * std::sqrt(std::max(0.0, radius * radius - x * x));
      const double sag = optics::sag(face, std::min(radius, std::sqrt(x * x + y * y)));
      place = placement.point({x, y, face.z_mm + sag});
      x = std::clamp(x - place.x / std::max(0.1, placement.rotation[0]), -radius, radius);
    }
    section.push_back(place);
  }
  return section;
}

std::string lens_svg(const LensPicture& picture) {
  const LensLayout layout(picture);
  SvgCanvas canvas(layout.width, layout.height, picture.title);
  draw(canvas, layout, picture);
  return canvas.take();
}

Raster lens_raster(const LensPicture& picture, double pixels_per_unit) {
  const LensLayout layout(picture);
  RasterCanvas canvas(layout.width, layout.height, pixels_per_unit);
  draw(canvas, layout, picture);
  return canvas.take();
}

}  // namespace relign::drawing
