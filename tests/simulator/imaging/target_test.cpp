#include "imaging/target.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "error_text.h"
#include "images/measures.h"
#include "imaging/scene_file.h"
#include "optics/elementary.h"

namespace relign::imaging {
namespace {

using testing::HasSubstr;

images::Image drawn(const std::string& text, int texels) {
  const std::optional<images::Image> image = draw_target(text, texels);
  EXPECT_TRUE(image.has_value()) << text;
  return image.value_or(images::Image(2, 2));
}

std::string refusal(const std::string& text) {
  return test::error_text(ErrorKind::bad_input, [&] { draw_target(text, 100); });
}

TEST(Target, MatchesThePapersSiemensStar) {
  const images::Image star = siemens_star(300);
  // 5 degrees above the row axis, to the right: white; 5 degrees below: black.
  EXPECT_EQ(star.at(280, 149 - 11), 1);
  EXPECT_EQ(star.at(280, 150 + 11), 0);
  double white = 0;
  for (const float value : star.values) white += static_cast<double>(value);
  EXPECT_NEAR(white / 90000, 0.5, 0.002);
  // Every direction from the centre has the opposite colour 10 degrees further, the same after 20.
  for (int degrees = 5; degrees < 360; degrees += 10) {
    const auto angle = optics::sine_cosine_of_degrees(degrees);
    const auto x = static_cast<std::size_t>(150 + 100 * angle.cosine);
    const auto y = static_cast<std::size_t>(150 - 100 * angle.sine);
    EXPECT_EQ(star.at(x, y), degrees / 10 % 2 == 0 ? 1 : 0) << degrees;
  }
}

TEST(Target, ChessboardAlternates) {
  const images::Image board = drawn("chessboard:fields=8", 400);
  for (std::size_t y = 0; y < 400; ++y)
    for (std::size_t x = 0; x < 400; ++x)
      ASSERT_EQ(board.at(x, y), (x / 50 + y / 50) % 2 == 0 ? 1 : 0) << x << ", " << y;
  EXPECT_EQ(drawn("chessboard", 1200).values, drawn("chessboard:fields=12", 1200).values);
}

TEST(Target, EdgeTexelsHaveTheGreyOfTheirWhiteShare) {
  // Fields of 10 / 3 texels: the first ends at a third of texel 3.
  const images::Image board = drawn("chessboard:fields=3", 10);
  EXPECT_EQ(board.at(0, 0), 1);
  EXPECT_FLOAT_EQ(board.at(3, 0), 85.0F / 255);
  EXPECT_FLOAT_EQ(board.at(6, 0), 85.0F / 255) << "two thirds of texel 6 belong to the black field";
  EXPECT_NEAR(board.at(3, 3), 5.0 / 9, 0.5 / 255) << "a corner of two white fields: (1/3)^2 and (2/3)^2";
}

TEST(Target, SlantedEdgesHaveTheirAngle) {
  for (const double angle : {5.0, -8.0}) {
    const images::Image bitmap = drawn("slanted_edges:squares=4,angle_deg=" + std::to_string(angle), 800);
    EXPECT_NEAR(images::mean(bitmap), 0.75, 1e-4) << "squares cover half of the side each way";
    EXPECT_EQ(bitmap.at(0, 0), 1);
    // The left edge of the square in the second field from the left: its position in two rows, from the white area to
    // its left.
    const auto edge_in_row = [&](std::size_t y) {
      double place = 200;
      for (std::size_t x = 200; x < 300; ++x) place += static_cast<double>(bitmap.at(x, y));
      return place;
    };
    EXPECT_EQ(bitmap.at(300, 300), 0);
    // Clockwise as displayed: the left edge goes right on the way up.
    const double slope = (edge_in_row(275) - edge_in_row(325)) / 50;
    EXPECT_NEAR(std::atan(slope) * 180 / 3.14159265358979, angle, 0.02);
  }
}

TEST(Target, UsafBarsHaveTheirPeriods) {
  const images::Image bars = drawn("usaf_bars:elements=1,period=0.1", 1000);
  // Three bars of half a period and five half periods long, twice.
  EXPECT_NEAR(images::mean(bars), 2 * 3 * 0.05 * 0.25, 1e-6);
  for (std::size_t x = 100; x < 350; ++x)
    ASSERT_EQ(bars.at(x, 200), x / 50 % 2 == 0 ? 1 : 0) << "vertical bars, column " << x;
  for (std::size_t y = 100; y < 350; ++y)
    ASSERT_EQ(bars.at(600, y), y / 50 % 2 == 0 ? 1 : 0) << "horizontal bars, row " << y;
  EXPECT_EQ(bars.at(110, 90), 0);
  EXPECT_EQ(bars.at(110, 360), 0);
  // Elements shrink by the sixth root of 1/2: the area of n of them is a geometric series.
  const double series = (1 - std::pow(2, -24.0 / 3)) / (1 - std::pow(2, -1.0 / 3));
  EXPECT_NEAR(images::mean(drawn("usaf_bars", 1200)), 2 * 3 * 0.03 * 0.15 * series, 1e-4);
}

TEST(Target, PointGridHasDiscs) {
  const images::Image grid = drawn("point_grid:points=5,diameter=0.2", 1000);
  // Greys are rounded to 1/255: 25 discs of some 80 texels of border.
  EXPECT_NEAR(images::mean(grid), 3.14159265358979 / 4 * 0.04, 1e-5);
  EXPECT_EQ(grid.at(100, 300), 1);
  EXPECT_EQ(grid.at(118, 300), 1);
  EXPECT_EQ(grid.at(121, 300), 0);
  EXPECT_EQ(grid.at(200, 300), 0);
  const images::Image one = drawn("point_grid:points=1,diameter=0.3", 301);
  const images::Moments found = images::moments(one);
  EXPECT_NEAR(found.centroid_x_px, 150, 1e-3);
  EXPECT_NEAR(found.width_px, 0.15 * 301 / 2, 0.05) << "a disc's second moment: radius / 2";
}

TEST(Target, EveryDrawingFillsItsBitmapWithStepsOf255) {
  for (const TargetKind& kind : target_kinds())
    for (const int texels : {2, 37, 256}) {
      const images::Image image = drawn(kind.name, texels);
      ASSERT_EQ(image.values.size(), static_cast<std::size_t>(texels) * static_cast<std::size_t>(texels)) << kind.name;
      for (const float value : image.values) {
        ASSERT_TRUE(value >= 0 && value <= 1) << kind.name << ' ' << value;
        ASSERT_NEAR(value * 255, std::round(value * 255), 1e-4) << kind.name;
      }
    }
}

TEST(Target, TellsPathsFromNames) {
  EXPECT_FALSE(draw_target("chart.png", 10));
  EXPECT_FALSE(draw_target("charts/star", 10));
  EXPECT_FALSE(draw_target("C:\\charts\\star", 10));
  EXPECT_TRUE(draw_target("slanted-edges:angle_deg=2.5", 10)) << "a dot in a number, a dash in a name";
}

TEST(Target, ErrorsListWhatIsAllowed) {
  EXPECT_THAT(
      refusal("chesboard:fields=2.5"),
      testing::AllOf(
          HasSubstr("unknown target 'chesboard:fields=2.5'; allowed: siemens_star, "),
          HasSubstr("chessboard, slanted_edges, camera_chart, usaf_bars, point_grid, white, or the path of an image "
                    "file; did you mean 'chessboard'?")));
  EXPECT_THAT(refusal("chessboard:sqares=3"), HasSubstr("unknown parameter 'sqares' of target 'chessboard'"));
  EXPECT_THAT(refusal("white:sectors=3"), HasSubstr("it has none"));
  for (const char* value : {"1", "257", "2.5", "x", "", "nan"})
    EXPECT_THAT(refusal(std::string("chessboard:fields=") + value),
                HasSubstr("fields must be an integer from 2 to 256, such as fields=12"))
        << value;
  EXPECT_THAT(refusal("slanted_edges:angle_deg=50"), HasSubstr("a number from -45 to 45"));
  EXPECT_THAT(refusal("usaf_bars:elements=48,period=0.15"), HasSubstr("of 48 elements fit"));
}

// A bitmap of 3 x 3 texels on a square of 3 mm, white in the left column alone: the right border's half texel blends
// towards white where the bitmap repeats. Expected values by hand; single rays and block kernels alike.
TEST(EmitterBorder, RepeatsTheOutermostTexelOrTheOppositeBorder) {
  for (const bool repeats : {false, true}) {
    Emitter emitter;
    emitter.z_mm = -1;
    emitter.side_mm = 3;
    emitter.repeats = repeats;
    images::Image bitmap(3, 3);
    for (std::size_t row = 0; row < 3; ++row) bitmap.at(0, row) = 1;
    emitter.show(bitmap);
    const struct {
      double x, clamped, repeated;
    } places[] = {{-1.4, 1, 0.6}, {-1, 1, 1},      {-0.75, 0.75, 0.75}, {0.5, 0, 0},
                  {1, 0, 0},      {1.25, 0, 0.25}, {1.4, 0, 0.4},       {1.6, 0, 0}};
    const auto block = std::make_unique<optics::RayBlock>();
    int ray = 0;
    for (const auto& place : places)
      for (const double y : {-1.45, 0.3}) {
        EXPECT_NEAR(emitter.radiance_at(place.x, y), repeats ? place.repeated : place.clamped, 1e-9) << place.x;
        block->x[ray] = static_cast<float>(place.x);
        block->y[ray] = static_cast<float>(y);
        block->z[ray] = block->lx[ray] = block->ly[ray] = 0;
        block->lz[ray] = -1;
        block->margin[ray++] = 1;
      }
    ASSERT_EQ(ray, 16);
    optics::block_kernels().look_up(*block, emitter.plane(), ray);
    for (int i = 0; i < ray; ++i)
      EXPECT_NEAR(block->radiance[i], repeats ? places[i / 2].repeated : places[i / 2].clamped, 1e-5)
          << places[i / 2].x;
  }
}

}  // namespace
}  // namespace relign::imaging
