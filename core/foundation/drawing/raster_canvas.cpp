#include "drawing/raster_canvas.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "drawing/png.h"
#include "images/codecs.h"

namespace relign::drawing {
namespace {

constexpr int kShift = 4;  // OpenCV takes places in sixteenths of a pixel
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;

cv::Scalar scalar(const Colour& colour) { return cv::Scalar(colour.red, colour.green, colour.blue); }

std::string ascii(const std::string& text) {
  std::string plain;
  for (const char byte : text) {
    const auto code = static_cast<unsigned char>(byte);
    if (code >= 0x20 && code < 0x7f) plain += byte;
    if (code >= 0xc0) plain += '?';  // the first byte of a longer character; the others are skipped
  }
  return plain;
}

}  // namespace

struct RasterCanvas::Pixels {
  cv::Mat image;
  double scale = 1;

  cv::Point fixed(const Point& point) const {
    return {static_cast<int>(std::lround(point.x * scale * (1 << kShift))),
            static_cast<int>(std::lround(point.y * scale * (1 << kShift)))};
  }
  std::vector<cv::Point> fixed(const std::vector<Point>& points) const {
    std::vector<cv::Point> all;
    for (const Point& point : points) all.push_back(fixed(point));
    return all;
  }
  int thickness(double width) const { return std::max(1, static_cast<int>(std::lround(width * scale))); }

  // Paints on a copy and blends it if the colour is not opaque.
  template <class Paint>
  void mix(const Colour& colour, const Paint& paint) {
    if (colour.opacity >= 1) {
      paint(image);
      return;
    }
    cv::Mat painted = image.clone();
    paint(painted);
    cv::addWeighted(painted, colour.opacity, image, 1 - colour.opacity, 0, image);
  }
};

RasterCanvas::RasterCanvas(double width, double height, double scale) : pixels_(std::make_unique<Pixels>()) {
  pixels_->scale = scale;
  pixels_->image = cv::Mat(static_cast<int>(std::ceil(height * scale)), static_cast<int>(std::ceil(width * scale)),
                           CV_8UC3, cv::Scalar(255, 255, 255));
}

RasterCanvas::~RasterCanvas() = default;

void RasterCanvas::polyline(const std::vector<Point>& points, const Stroke& stroke) {
  const std::vector<std::vector<cv::Point>> lines = {pixels_->fixed(points)};
  pixels_->mix(stroke.colour, [&](cv::Mat& image) {
    cv::polylines(image, lines, false, scalar(stroke.colour), pixels_->thickness(stroke.width), cv::LINE_AA, kShift);
  });
}

void RasterCanvas::segments(const std::vector<Segment>& segments, const Stroke& stroke) {
  if (segments.empty()) return;
  std::vector<std::vector<cv::Point>> lines;
  for (const auto& [from, to] : segments) lines.push_back({pixels_->fixed(from), pixels_->fixed(to)});
  pixels_->mix(stroke.colour, [&](cv::Mat& image) {
    cv::polylines(image, lines, false, scalar(stroke.colour), pixels_->thickness(stroke.width), cv::LINE_AA, kShift);
  });
}

void RasterCanvas::polygon(const std::vector<Point>& points, const std::optional<Colour>& fill,
                           const std::optional<Stroke>& edge) {
  const std::vector<std::vector<cv::Point>> shapes = {pixels_->fixed(points)};
  if (fill)
    pixels_->mix(*fill, [&](cv::Mat& image) { cv::fillPoly(image, shapes, scalar(*fill), cv::LINE_AA, kShift); });
  if (edge)
    pixels_->mix(edge->colour, [&](cv::Mat& image) {
      cv::polylines(image, shapes, true, scalar(edge->colour), pixels_->thickness(edge->width), cv::LINE_AA, kShift);
    });
}

void RasterCanvas::circle(const Point& centre, double radius, const std::optional<Colour>& fill,
                          const std::optional<Stroke>& edge) {
  const int fixed_radius = static_cast<int>(std::lround(radius * pixels_->scale * (1 << kShift)));
  const auto draw = [&](const Colour& colour, int thickness) {
    pixels_->mix(colour, [&](cv::Mat& image) {
      cv::circle(image, pixels_->fixed(centre), fixed_radius, scalar(colour), thickness, cv::LINE_AA, kShift);
    });
  };
  if (fill) draw(*fill, cv::FILLED);
  if (edge) draw(edge->colour, pixels_->thickness(edge->width));
}

void RasterCanvas::text(const Point& at, const std::string& text, const TextStyle& style) {
  const std::string plain = ascii(text);
  if (plain.empty()) return;
  // Capital letters of this font are 21 units tall; those of screen fonts 0.72 of the size.
  const double font_scale = 0.72 * style.size * pixels_->scale / 21;
  const int thickness =
      std::max(1, static_cast<int>(std::lround(style.size * pixels_->scale * (style.bold ? 0.11 : 0.065))));
  int below = 0;
  const cv::Size size = cv::getTextSize(plain, kFont, font_scale, thickness, &below);
  const int margin = thickness + 2;
  // Draws the text separately as darkness, so that it can be rotated and keeps smooth edges.
  cv::Mat ink(size.height + 2 * below + 2 * margin, size.width + 2 * margin, CV_8U, cv::Scalar(0));
  cv::putText(ink, plain, {margin, size.height + margin}, kFont, font_scale, cv::Scalar(255), thickness, cv::LINE_AA);
  const int shift = style.anchor == Anchor::start ? 0 : style.anchor == Anchor::middle ? size.width / 2 : size.width;
  cv::Point corner(static_cast<int>(std::lround(at.x * pixels_->scale)) - margin - shift,
                   static_cast<int>(std::lround(at.y * pixels_->scale)) - margin - size.height);
  if (style.upwards) {
    cv::rotate(ink, ink, cv::ROTATE_90_COUNTERCLOCKWISE);
    corner = {static_cast<int>(std::lround(at.x * pixels_->scale)) - margin - size.height,
              static_cast<int>(std::lround(at.y * pixels_->scale)) + margin + shift - ink.rows};
  }
  const cv::Rect seen = cv::Rect(corner, ink.size()) & cv::Rect({0, 0}, pixels_->image.size());
  if (seen.empty()) return;
  for (int row = seen.y; row < seen.y + seen.height; ++row)
    for (int column = seen.x; column < seen.x + seen.width; ++column) {
      const int darkness = ink.at<std::uint8_t>(row - corner.y, column - corner.x);
      auto& pixel = pixels_->image.at<cv::Vec3b>(row, column);
      const std::uint8_t parts[] = {style.colour.red, style.colour.green, style.colour.blue};
      for (int k = 0; k < 3; ++k)
        pixel[k] = static_cast<std::uint8_t>((pixel[k] * (255 - darkness) + parts[k] * darkness + 127) / 255);
    }
}

void RasterCanvas::picture(const Rectangle& place, const Raster& picture) {
  const cv::Mat source(picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.rgb.data()));
  const auto pixel = [&](double value) { return static_cast<int>(std::lround(value * pixels_->scale)); };
  const cv::Rect target(pixel(place.x), pixel(place.y), pixel(place.x + place.width) - pixel(place.x),
                        pixel(place.y + place.height) - pixel(place.y));
  cv::Mat scaled;
  cv::resize(source, scaled, target.size(), 0, 0, cv::INTER_LINEAR);
  const cv::Rect seen = target & cv::Rect({0, 0}, pixels_->image.size());
  if (!seen.empty()) scaled(seen - target.tl()).copyTo(pixels_->image(seen));
}

Raster RasterCanvas::take() {
  Raster out;
  out.width = pixels_->image.cols;
  out.height = pixels_->image.rows;
  out.rgb.assign(pixels_->image.datastart, pixels_->image.dataend);
  return out;
}

std::string png_bytes(const Raster& picture) {
  return images::encode_png(
      {static_cast<std::size_t>(picture.width), static_cast<std::size_t>(picture.height), 3, picture.rgb, {}});
}

}  // namespace relign::drawing
