// Both canvases and the scales, on drawings with known results.
#include <gmock/gmock.h>

#include "drawing/colours.h"
#include "drawing/raster_canvas.h"
#include "drawing/scales.h"
#include "drawing/svg_canvas.h"

namespace relign::drawing {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<int> pixel(const Raster& raster, int x, int y) {
  const std::size_t at = 3 * (static_cast<std::size_t>(y) * raster.width + x);
  return {raster.rgb[at], raster.rgb[at + 1], raster.rgb[at + 2]};
}

TEST(RasterCanvas, PaintsAreasPicturesAndMixedColours) {
  RasterCanvas canvas(20, 10, 2);
  canvas.rectangle({0, 0, 8, 10}, Colour{200, 100, 0}, {});
  canvas.rectangle({0, 0, 4, 10}, Colour{0, 0, 0, 0.5}, {});
  canvas.picture({10, 0, 10, 10}, {1, 1, {1, 2, 3}});
  const Raster raster = canvas.take();
  EXPECT_EQ(raster.width, 40);
  EXPECT_EQ(raster.height, 20);
  EXPECT_THAT(pixel(raster, 4, 10), ElementsAre(100, 50, 0));
  EXPECT_THAT(pixel(raster, 12, 10), ElementsAre(200, 100, 0));
  EXPECT_THAT(pixel(raster, 18, 10), ElementsAre(255, 255, 255));
  EXPECT_THAT(pixel(raster, 30, 10), ElementsAre(1, 2, 3));
}

// Bounding box of dark pixels: columns and rows.
std::vector<int> dark_box(const Raster& raster) {
  std::vector<int> box = {raster.width, raster.height, -1, -1};
  for (int y = 0; y < raster.height; ++y)
    for (int x = 0; x < raster.width; ++x)
      if (pixel(raster, x, y)[0] < 128)
        box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x), std::max(box[3], y)};
  return box;
}

TEST(RasterCanvas, PlacesTextAtItsAnchor) {
  const auto box_of = [](Anchor anchor, bool upwards) {
    RasterCanvas canvas(200, 200, 1);
    canvas.text({100, 100}, "HHHH", {20, kInk, anchor, upwards});
    return dark_box(canvas.take());
  };
  const std::vector<int> start = box_of(Anchor::start, false), end = box_of(Anchor::end, false);
  EXPECT_NEAR(start[0], 100, 4);
  EXPECT_NEAR(start[3], 100, 3);
  EXPECT_NEAR(start[1], 100 - 0.72 * 20, 3);
  EXPECT_NEAR(end[2], 100, 4);
  const std::vector<int> middle = box_of(Anchor::middle, true);  // from bottom to top
  EXPECT_NEAR((middle[1] + middle[3]) / 2.0, 100, 3);
  EXPECT_NEAR(middle[2], 100, 3);
  EXPECT_GT(middle[3] - middle[1], middle[2] - middle[0]);
}

TEST(RasterCanvas, ClipsTextAtTheEdge) {
  RasterCanvas canvas(30, 30, 1);
  canvas.text({-10, 5}, "long words beyond both edges", {20, kInk});
  canvas.text({500, 500}, "nowhere", {20, kInk});
  EXPECT_GE(dark_box(canvas.take())[2], 20);
}

TEST(SvgCanvas, WritesShapesWithEscapedText) {
  SvgCanvas canvas(100, 50, "t");
  canvas.polyline({{0, 0.004}, {1.125, -2}}, {Colour{255, 0, 16}, 1.5, true});
  canvas.text({3, 4}, "a < b", {10, kInk, Anchor::middle, true, true});
  const std::string svg = canvas.take();
  EXPECT_THAT(svg, HasSubstr("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 100 50\""));
  EXPECT_THAT(svg, HasSubstr("<polyline points=\"0,0 1.13,-2\" fill=\"none\" stroke=\"#ff0010\" stroke-width=\"1.5\" "
                             "stroke-dasharray"));
  EXPECT_THAT(svg,
              HasSubstr("text-anchor=\"middle\" font-weight=\"600\" transform=\"rotate(-90 3 4)\">a &lt; b</text>"));
}

TEST(Scales, StepsAreRound) {
  EXPECT_DOUBLE_EQ(round_step(7.3), 5);
  EXPECT_DOUBLE_EQ(round_step(0.2), 0.2);
  EXPECT_DOUBLE_EQ(round_step(0.00199), 0.001);
  const std::vector<double> axis = ticks(-1, 1, 4);
  ASSERT_EQ(axis.size(), 5U);
  EXPECT_DOUBLE_EQ(axis[1], -0.5);
  for (const double high : {0.013, 0.4, 7.0, 123.0})
    for (const int count : {3, 5, 10}) {
      EXPECT_LE(ticks(0, high, count).size(), count + 1U) << high;
      EXPECT_GE(ticks(0, high, count).size(), count / 2U) << high;
    }
  EXPECT_EQ(tick_text(-0.25, 0.05), "-0.25");
  EXPECT_EQ(tick_text(-1e-12, 0.5), "0.0");
  EXPECT_EQ(tick_text(20, 5), "20");
}

TEST(Colours, MapIncreasesInBrightness) {
  double before = -1;
  for (double share = 0; share <= 1; share += 0.05) {
    const Colour colour = map_colour(share);
    const double brightness = 0.2126 * colour.red + 0.7152 * colour.green + 0.0722 * colour.blue;
    EXPECT_GT(brightness, before) << share;
    before = brightness;
  }
  EXPECT_EQ(map_colour(-1).blue, map_colour(0).blue);
  EXPECT_EQ(map_colour(2).red, 253);
}

}  // namespace
}  // namespace relign::drawing
