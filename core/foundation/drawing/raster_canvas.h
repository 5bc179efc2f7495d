// A canvas of pixels, drawn with OpenCV. Text is ASCII: other characters become '?'.
#pragma once

#include <memory>

#include "drawing/canvas.h"

namespace relign::drawing {

class RasterCanvas final : public Canvas {
 public:
  // `scale`: pixels per unit of the drawing.
  RasterCanvas(double width, double height, double scale);
  ~RasterCanvas() override;

  void polyline(const std::vector<Point>& points, const Stroke& stroke) override;
  void segments(const std::vector<Segment>& segments, const Stroke& stroke) override;
  void polygon(const std::vector<Point>& points, const std::optional<Colour>& fill,
               const std::optional<Stroke>& edge) override;
  void circle(const Point& centre, double radius, const std::optional<Colour>& fill,
              const std::optional<Stroke>& edge) override;
  void text(const Point& at, const std::string& text, const TextStyle& style) override;
  void picture(const Rectangle& place, const Raster& picture) override;
  void open_group(const std::string&, const std::string&) override {}
  void close_group() override {}

  Raster take();

 private:
  struct Pixels;
  std::unique_ptr<Pixels> pixels_;
};

}  // namespace relign::drawing
