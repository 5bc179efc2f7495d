// Fields of charts that are painted analytically: slightly rotated dark squares, blurred by a Gaussian.
#include "images/edge_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "images/painted_chart.h"

namespace relign::images {
namespace {

using namespace painted_chart;

TEST(EdgeFields, FollowMarksAndMeasureEveryField) {
  constexpr double kSigma = 1.3, kFrequency = 0.125;
  for (const auto& [dx, dy] : {std::pair{0.0, 0.0}, std::pair{7.4, -3.2}, std::pair{-28.0, 31.0}}) {
    const Image image = chart(240 + dx, 180 + dy, kSigma, 0.9, 0.005);
    const FieldEdges edges(image, nine_fields());
    for (std::size_t field = 0; field < nine_fields().size(); ++field) {
      SCOPED_TRACE(nine_fields()[field].name + " moved by " + std::to_string(dx) + ", " + std::to_string(dy));
      for (const Direction direction : {Direction::tangential, Direction::sagittal})
        EXPECT_NEAR(edges.mtf(field, direction, kFrequency), gaussian(kSigma, kFrequency), 0.02);
    }
    EXPECT_NEAR(edges.mark_x_px(0), 240 + dx, 0.3);
    EXPECT_NEAR(edges.mark_y_px(0), 180 + dy, 0.3);
  }
}

TEST(EdgeFields, MeasuresWhatIsLeftOfARegion) {
  const Image image = chart(240, 180 - 58, 1.3);
  const FieldEdges edges(image, {nine_fields()});
  const auto upper_row = 2U;  // its squares have left the image by half
  EXPECT_TRUE(std::isnan(edges.mark_y_px(upper_row)));
  EXPECT_NEAR(edges.mtf(upper_row, Direction::tangential, 0.125), gaussian(1.3, 0.125), 0.03);
  EXPECT_TRUE(std::isnan(edges.mtf(upper_row, Direction::sagittal, 0.125))) << "the upper edge is outside";
}

TEST(EdgeFields, TrustNothingOutsideTheirWindows) {
  // Black outside a window of 136 pixels around the central field, as of a sensor that reads out windows only.
  EdgeFields fields = {nine_fields().front()};
  fields[0].window = Region{240 - 68, 180 - 68, 136, 136};
  const auto windowed = [&](double x0) {
    Image image = chart(x0, 180, 1.3);
    for (std::size_t y = 0; y < image.height; ++y)
      for (std::size_t x = 0; x < image.width; ++x)
        if (x < 172 || x >= 308 || y < 112 || y >= 248) image.at(x, y) = 0;
    return image;
  };
  const Image near = windowed(244), far = windowed(262);
  const FieldEdges found(near, fields), lost(far, fields);
  EXPECT_NEAR(found.mark_x_px(0), 244, 0.3);
  EXPECT_NEAR(found.mtf(0, Direction::tangential, 0.125), gaussian(1.3, 0.125), 0.02);
  EXPECT_TRUE(std::isnan(lost.mark_x_px(0)));
}

TEST(EdgeFields, AreNanWithoutEdges) {
  for (const Image& image : {Image(480, 360, 0.0F), Image(480, 360, 0.7F), chart(240, 180, 40)}) {
    const FieldEdges edges(image, nine_fields());
    for (std::size_t field = 0; field < nine_fields().size(); ++field)
      EXPECT_TRUE(std::isnan(edges.mtf(field, Direction::sagittal, 0.125)));
  }
  EXPECT_EQ(FieldEdges(Image(480, 360, 0.0F), nine_fields()).edge_energy(), 0);
}

TEST(EdgeEnergy, DecreasesWithBlurAndIgnoresTheLightLevel) {
  double before = 1e9;
  for (const double sigma : {0.7, 1.0, 2.0, 4.0, 8.0}) {
    const Image image = chart(243, 178, sigma), brighter = chart(243, 178, sigma, 7.2);
    const double energy = FieldEdges(image, nine_fields()).edge_energy();
    EXPECT_LT(energy, before) << sigma;
    EXPECT_NEAR(FieldEdges(brighter, nine_fields()).edge_energy() / energy, 1, 1e-6);
    const Image noisy = chart(243, 178, sigma, 0.9, 0.09);
    EXPECT_NEAR(FieldEdges(noisy, nine_fields()).edge_energy(), energy, 0.1 * energy + 1e-4) << "noise adds nothing";
    before = energy;
  }
}

TEST(EdgeFields, AreReadAsWritten) {
  const Json written = to_json(nine_fields());
  const JsonSource source = JsonSource::from_text(Json{{"fields", written}}.dump(), "description");
  std::vector<Problem> problems;
  EXPECT_EQ(to_json(read_edge_fields(source, "/fields", 480, 360, problems)), written);
  EXPECT_TRUE(problems.empty());
}

TEST(EdgeFields, RejectsMistakes) {
  const auto mistakes = [](const std::string& fields) {
    const JsonSource source = JsonSource::from_text(R"({"fields": )" + fields + "}", "description");
    std::vector<Problem> problems;
    read_edge_fields(source, "/fields", 480, 360, problems);
    std::string text;
    for (const Problem& problem : problems) text += problem.message + "\n";
    return text;
  };
  const std::string region = R"({"x": 400, "y": 10, "width": 90, "height": 40})";
  EXPECT_THAT(mistakes("[]"), testing::HasSubstr("expected a list of 1 to 64 fields"));
  EXPECT_THAT(mistakes(R"([{"name": "a"}])"), testing::HasSubstr("expected a region 'tangential' or 'sagittal'"));
  EXPECT_THAT(mistakes(R"([{"name": "a", "tangential": )" + region + "}]"),
              testing::HasSubstr("exceeds the image of 480 x 360 pixels"));
  EXPECT_THAT(mistakes(R"([{"name": "a", "radial": 1}])"), testing::HasSubstr("unknown key 'radial'"));
}

}  // namespace
}  // namespace relign::images
