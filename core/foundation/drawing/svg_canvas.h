// A canvas that writes a self-contained SVG file: pictures are embedded, fonts are the viewer's.
#pragma once

#include <string>

#include "drawing/canvas.h"
#include "markup/html_writer.h"

namespace relign::drawing {

class SvgCanvas final : public Canvas {
 public:
  SvgCanvas(double width, double height, const std::string& title);

  void polyline(const std::vector<Point>& points, const Stroke& stroke) override;
  void segments(const std::vector<Segment>& segments, const Stroke& stroke) override;
  void polygon(const std::vector<Point>& points, const std::optional<Colour>& fill,
               const std::optional<Stroke>& edge) override;
  void circle(const Point& centre, double radius, const std::optional<Colour>& fill,
              const std::optional<Stroke>& edge) override;
  void text(const Point& at, const std::string& text, const TextStyle& style) override;
  void picture(const Rectangle& place, const Raster& picture) override;
  void open_group(const std::string& name, const std::string& words) override;
  void close_group() override;

  // The whole drawing. Call once, last.
  std::string take();

 private:
  HtmlWriter writer_;
};

// At most two decimals, without trailing zeros; independent of the locale.
std::string coordinate(double value);

}  // namespace relign::drawing
