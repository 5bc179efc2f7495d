// Fields of charts that are painted analytically: slightly rotated dark squares, blurred by a Gaussian.
#include "images/edge_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <relign/random.hpp>

namespace relign::images {
namespace {

constexpr double kSpacing = 120, kSide = 60, kTurn_deg = 5;
constexpr double kDegree = 3.14159265358979323846 / 180;

// Dark squares on a grid around (x0, y0).
Image chart(double x0, double y0, double sigma, double white = 0.9, double noise = 0) {
  Image image(480, 360);
  Random random(3);
  const double cosine = std::cos(kTurn_deg * kDegree), sine = std::sin(kTurn_deg * kDegree);
  const auto within = [&](double along) {
    const double scale = sigma * std::sqrt(2.0);
    return 0.5 * (std::erf((along + kSide / 2) / scale) - std::erf((along - kSide / 2) / scale));
  };
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) {
      const double dx = static_cast<double>(x) - x0, dy = static_cast<double>(y) - y0;
      const double u = dx - kSpacing * std::round(dx / kSpacing), v = dy - kSpacing * std::round(dy / kSpacing);
      const double dark = within(cosine * u + sine * v) * within(cosine * v - sine * u);
      image.at(x, y) = static_cast<float>(white * (1 - 0.9 * dark) + noise * random.normal());
    }
  return image;
}

// The regions around the left and the upper edge of the square at (x, y).
EdgeField field_at(const char* name, double x, double y) {
  const auto centred = [](double cx, double cy, std::size_t width, std::size_t height) {
    return Region{static_cast<std::size_t>(cx) - width / 2, static_cast<std::size_t>(cy) - height / 2, width, height};
  };
  return {name, Mark{x, y, kSide}, centred(x - kSide / 2, y, 50, 36), centred(x, y - kSide / 2, 36, 50)};
}

const EdgeFields& nine_fields() {
  static const EdgeFields fields = [] {
    EdgeFields made = {field_at("centre", 240, 180)};
    for (int row = -1; row <= 1; ++row)
      for (int column = -1; column <= 1; ++column)
        if (row != 0 || column != 0)
          made.push_back(field_at(("r" + std::to_string(row) + "c" + std::to_string(column)).c_str(),
                                  240 + kSpacing * column, 180 + kSpacing * row));
    return made;
  }();
  return fields;
}

double gaussian(double sigma, double f) { return std::exp(-2 * std::pow(3.14159265358979323846 * sigma * f, 2)); }

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
