#include "drawing/svg_canvas.h"

#include <charconv>
#include <cmath>

#include "drawing/png.h"
#include "markup/escape.h"

namespace relign::drawing {
namespace {

std::string hex(const Colour& colour) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text = "#";
  for (const std::uint8_t part : {colour.red, colour.green, colour.blue}) {
    text += kDigits[part >> 4];
    text += kDigits[part & 15];
  }
  return text;
}

void add_stroke(Attributes& attributes, const Stroke& stroke) {
  attributes.emplace_back("stroke", hex(stroke.colour));
  attributes.emplace_back("stroke-width", coordinate(stroke.width));
  if (stroke.colour.opacity < 1) attributes.emplace_back("stroke-opacity", coordinate(stroke.colour.opacity));
  if (stroke.dashed) attributes.emplace_back("stroke-dasharray", "8 4 2 4");
}

Attributes paint(const std::optional<Colour>& fill, const std::optional<Stroke>& edge) {
  Attributes attributes = {{"fill", fill ? hex(*fill) : "none"}};
  if (fill && fill->opacity < 1) attributes.emplace_back("fill-opacity", coordinate(fill->opacity));
  if (edge) add_stroke(attributes, *edge);
  return attributes;
}

Attributes with(Attributes attributes, const Attributes& more) {
  attributes.insert(attributes.end(), more.begin(), more.end());
  return attributes;
}

std::string point_list(const std::vector<Point>& points) {
  std::string text;
  for (const Point& point : points) {
    if (!text.empty()) text += ' ';
    text += coordinate(point.x) + "," + coordinate(point.y);
  }
  return text;
}

}  // namespace

std::string coordinate(double value) {
  double rounded = std::round(value * 100) / 100;
  if (rounded == 0) rounded = 0;  // no "-0"
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, rounded, std::chars_format::fixed, 2).ptr;
  std::string text(buffer, end);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

double text_width(const std::string& text, double size) {
  std::size_t characters = 0;
  for (const char byte : text)
    if ((static_cast<unsigned char>(byte) & 0xc0) != 0x80) ++characters;
  return 0.58 * size * static_cast<double>(characters);
}

SvgCanvas::SvgCanvas(double width, double height, const std::string& title) {
  const std::string w = coordinate(width), h = coordinate(height);
  writer_.open("svg", {{"xmlns", "http://www.w3.org/2000/svg"},
                       {"viewBox", "0 0 " + w + " " + h},
                       {"width", w},
                       {"height", h},
                       {"font-family", "Helvetica, Arial, sans-serif"}});
  writer_.text("\n").element("title", title).text("\n");
  rectangle({0, 0, width, height}, Colour{255, 255, 255}, {});
}

void SvgCanvas::polyline(const std::vector<Point>& points, const Stroke& stroke) {
  writer_.empty("polyline", with({{"points", point_list(points)}}, paint({}, stroke))).text("\n");
}

void SvgCanvas::segments(const std::vector<Segment>& segments, const Stroke& stroke) {
  if (segments.empty()) return;
  std::string path;
  for (const auto& [from, to] : segments)
    path += "M" + coordinate(from.x) + " " + coordinate(from.y) + "L" + coordinate(to.x) + " " + coordinate(to.y);
  writer_.empty("path", with({{"d", path}}, paint({}, stroke))).text("\n");
}

void SvgCanvas::polygon(const std::vector<Point>& points, const std::optional<Colour>& fill,
                        const std::optional<Stroke>& edge) {
  writer_.empty("polygon", with({{"points", point_list(points)}}, paint(fill, edge))).text("\n");
}

void SvgCanvas::circle(const Point& centre, double radius, const std::optional<Colour>& fill,
                       const std::optional<Stroke>& edge) {
  const Attributes place = {{"cx", coordinate(centre.x)}, {"cy", coordinate(centre.y)}, {"r", coordinate(radius)}};
  writer_.empty("circle", with(place, paint(fill, edge))).text("\n");
}

void SvgCanvas::text(const Point& at, const std::string& text, const TextStyle& style) {
  const std::string x = coordinate(at.x), y = coordinate(at.y);
  Attributes attributes = {{"x", x}, {"y", y}, {"font-size", coordinate(style.size)}, {"fill", hex(style.colour)}};
  if (style.anchor != Anchor::start)
    attributes.emplace_back("text-anchor", style.anchor == Anchor::middle ? "middle" : "end");
  if (style.bold) attributes.emplace_back("font-weight", "600");
  if (style.upwards) attributes.emplace_back("transform", "rotate(-90 " + x + " " + y + ")");
  writer_.element("text", attributes, text).text("\n");
}

void SvgCanvas::picture(const Rectangle& place, const Raster& picture) {
  writer_
      .empty("image", {{"x", coordinate(place.x)},
                       {"y", coordinate(place.y)},
                       {"width", coordinate(place.width)},
                       {"height", coordinate(place.height)},
                       {"preserveAspectRatio", "none"},
                       {"href", "data:image/png;base64," + base64(png_bytes(picture))}})
      .text("\n");
}

void SvgCanvas::open_group(const std::string& name, const std::string& words) {
  writer_.open("g", {{"class", name}});
  if (!words.empty()) writer_.element("title", words);
  writer_.text("\n");
}

void SvgCanvas::close_group() { writer_.close().text("\n"); }

std::string SvgCanvas::take() {
  writer_.close().text("\n");
  return writer_.take();
}

}  // namespace relign::drawing
