// Abstract canvas: each drawing is written once and rendered as SVG (svg_canvas.h) or pixels (raster_canvas.h). Lengths
// in pixels of the picture, x to the right, y downwards.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relign::drawing {

struct Colour {
  std::uint8_t red = 0, green = 0, blue = 0;
  double opacity = 1;
};

struct Point {
  double x = 0, y = 0;
};

struct Rectangle {
  double x = 0, y = 0, width = 0, height = 0;
};

struct Stroke {
  Colour colour;
  double width = 1;
  bool dashed = false;  // on pixels a plain line: OpenCV draws no dashes
};

enum class Anchor { start, middle, end };

struct TextStyle {
  double size = 12;
  Colour colour;
  Anchor anchor = Anchor::start;
  bool upwards = false;  // reads from bottom to top
  bool bold = false;
};

// Row 0 on top, three bytes a pixel.
struct Raster {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

using Segment = std::pair<Point, Point>;

class Canvas {
 public:
  virtual ~Canvas() = default;

  virtual void polyline(const std::vector<Point>& points, const Stroke& stroke) = 0;
  virtual void segments(const std::vector<Segment>& segments, const Stroke& stroke) = 0;
  virtual void polygon(const std::vector<Point>& points, const std::optional<Colour>& fill,
                       const std::optional<Stroke>& edge) = 0;
  virtual void circle(const Point& centre, double radius, const std::optional<Colour>& fill,
                      const std::optional<Stroke>& edge) = 0;
  // `at` is the point of the baseline that the anchor selects.
  virtual void text(const Point& at, const std::string& text, const TextStyle& style) = 0;
  virtual void picture(const Rectangle& place, const Raster& picture) = 0;

  // Groups what is drawn until close_group(): `name` is a class for scripts and style sheets, `words` a tooltip.
  virtual void open_group(const std::string& name, const std::string& words) = 0;
  virtual void close_group() = 0;

  void rectangle(const Rectangle& place, const std::optional<Colour>& fill, const std::optional<Stroke>& edge) {
    polygon({{place.x, place.y},
             {place.x + place.width, place.y},
             {place.x + place.width, place.y + place.height},
             {place.x, place.y + place.height}},
            fill, edge);
  }
};

// Approximate width of a text, for placing labels. Counts characters, not bytes.
double text_width(const std::string& text, double size);

}  // namespace relign::drawing
