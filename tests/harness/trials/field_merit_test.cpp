// Merits by field on charts that are painted analytically.
#include "trials/field_merit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "images/painted_chart.h"
#include "trials/measure_table.h"

namespace relign::trials {
namespace {

using images::painted_chart::chart;
using images::painted_chart::gaussian;
using testing::HasSubstr;

constexpr double kSharp = 1.0, kBlurred = 2.2, kTolerance = 0.02;
constexpr double kQuarter = 0.125;  // cycles per pixel, a quarter of the Nyquist frequency

SceneFacts scene_with_fields() {
  SceneFacts scene;
  scene.name = "painted";
  scene.image_width = 480;
  scene.image_height = 360;
  scene.fields = images::painted_chart::nine_fields();
  scene.pitch_um = 5;
  return scene;
}

// Sharp in the middle, blurred on the right.
images::Image with_a_blurred_side() {
  images::Image image = chart(240, 180, kSharp);
  const images::Image blurred = chart(240, 180, kBlurred);
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 300; x < image.width; ++x) image.at(x, y) = blurred.at(x, y);
  return image;
}

// Of the lens: the painted pixels are points, but the merit divides by the square pixel's MTF.
double lens_mtf(double sigma) {
  return gaussian(sigma, kQuarter) * std::numbers::pi * kQuarter / std::sin(std::numbers::pi * kQuarter);
}

TEST(FieldMerit, MtfWithoutLimitsIsTheWorstFields) {
  const SceneFacts scene = scene_with_fields();
  const images::Image reference = chart(240, 180, 0.7);
  const FieldMerit merit(Merit::mtf, {}, scene, reference);
  EXPECT_NEAR(merit.of(chart(240, 180, kSharp), scene.fields), 1 - lens_mtf(kSharp), kTolerance);
  EXPECT_NEAR(merit.of(with_a_blurred_side(), scene.fields), 1 - lens_mtf(kBlurred), kTolerance);
  EXPECT_EQ(merit.of(images::Image(480, 360, 0.0F), scene.fields), 1) << "the worst value";
}

TEST(FieldMerit, MtfWithLimitsIsTheLargestDeficit) {
  const SceneFacts scene = scene_with_fields();
  const images::Image reference = chart(240, 180, 0.7);
  const auto merit = [&](double centre, double corner, const images::Image& capture) {
    return FieldMerit(Merit::mtf, {25, centre, corner}, scene, reference).of(capture, scene.fields);  // 25 lp/mm x 5 um
  };
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(merit(0.4, 0.1, with_a_blurred_side()), 0) << "within the limits";
  EXPECT_NEAR(merit(0.4, 0.6, with_a_blurred_side()), 0.6 - lens_mtf(kBlurred), kTolerance);
  EXPECT_NEAR(merit(0.95, 0.3, with_a_blurred_side()), 0.95 - lens_mtf(kSharp), kTolerance) << "the centre";
  EXPECT_NEAR(merit(0.95, none, with_a_blurred_side()), 0.95 - lens_mtf(kSharp), kTolerance);
  EXPECT_EQ(merit(0.8, 0.6, images::Image(480, 360, 0.0F)), 0.8) << "edges that cannot be measured have MTF 0";
}

TEST(FieldMerit, EdgeEnergyIsAHalfWhereTheCaptureIsAsSharpAsTheReference) {
  const SceneFacts scene = scene_with_fields();
  const images::Image reference = chart(240, 180, 0.9);
  const FieldMerit merit(Merit::edge_energy, {}, scene, reference);
  EXPECT_NEAR(merit.of(reference, scene.fields), 0.5, 1e-12);
  EXPECT_NEAR(merit.of(chart(243, 178, 0.9, 7.2), scene.fields), 0.5, 0.01) << "brighter and shifted";
  double before = 0.5;
  for (const double sigma : {1.2, 2.0, 5.0}) {
    const double now = merit.of(chart(240, 180, sigma), scene.fields);
    EXPECT_GT(now, before + 0.02);
    before = now;
  }
  EXPECT_EQ(merit.of(images::Image(480, 360, 0.0F), scene.fields), 1);
}

TEST(FieldMerit, StatesWhatTheSceneLacks) {
  SceneFacts scene = scene_with_fields();
  EXPECT_EQ(field_merit_mistake(Merit::mtf, {25, 0.5, 0.5}, scene), "");
  EXPECT_THAT(field_merit_mistake(Merit::mtf, {150, 0.5, 0.5}, scene), HasSubstr("at most 100 lp/mm"));
  scene.pitch_um = 0;
  EXPECT_THAT(field_merit_mistake(Merit::mtf, {25, 0.5, 0.5}, scene), HasSubstr("'pitch_um'"));
  EXPECT_EQ(field_merit_mistake(Merit::mtf, {}, scene), "");
  scene.fields.clear();
  EXPECT_THAT(field_merit_mistake(Merit::edge_energy, {}, scene), HasSubstr("'painted' describes no 'fields'"));
  EXPECT_EQ(field_merit_mistake(Merit::rmse, {}, scene), "");
  EXPECT_THROW(FieldMerit(Merit::mtf, {}, scene, images::Image(480, 360)), Error);
  EXPECT_THROW(FieldMerit(Merit::mtf, {}, scene_with_fields(), images::Image(480, 360)), Error) << "dark reference";
}

double measured(const images::Image& image, const std::string& name, const Json& arguments) {
  return measure(image, image, scene_with_fields(), name, arguments.dump());
}

TEST(FieldMeasures, AreThoseOfTheNamedField) {
  const images::Image image = with_a_blurred_side();
  const auto mtf = [&](Json arguments) {
    if (!arguments.contains("lp_per_mm")) arguments["cycles_per_pixel"] = kQuarter;
    return measured(image, "field_mtf", arguments);
  };
  EXPECT_NEAR(mtf({{"field", "centre"}}), gaussian(kSharp, kQuarter), kTolerance);
  EXPECT_EQ(mtf({{"field", 0}, {"lp_per_mm", 25}}), mtf({{"field", "centre"}}));
  EXPECT_EQ(mtf({{"field", "centre"}}), std::min(mtf({{"field", "centre"}, {"direction", "tangential"}}),
                                                 mtf({{"field", "centre"}, {"direction", "sagittal"}})));
  EXPECT_NEAR(mtf(Json::object()), gaussian(kBlurred, kQuarter), kTolerance) << "the lowest of all";
  EXPECT_NEAR(measured(chart(243.5, 178, 1.5), "mark_x_px", {{"field", 0}}), 243.5, 0.3);
  EXPECT_NEAR(measured(chart(243.5, 178, 1.5), "mark_y_px", {{"field", "centre"}}), 178, 0.3);
  EXPECT_TRUE(std::isnan(measured(images::Image(480, 360), "field_mtf", {{"cycles_per_pixel", 0.1}})));
}

TEST(FieldMeasures, OfAllFieldsEqualThoseOfEach) {
  const SceneFacts scene = scene_with_fields();
  const images::Image image = with_a_blurred_side();
  const FieldMeasures all(image, scene, R"({"lp_per_mm": 25})");
  relign_field_measures fields{};
  EXPECT_THROW(all.write(&fields), Error) << "no struct_size";
  fields.struct_size = sizeof fields;
  all.write(&fields);
  ASSERT_EQ(fields.count, 9U);
  for (std::uint32_t i = 0; i < fields.count; ++i) {
    EXPECT_EQ(std::string(fields.name[i].data, fields.name[i].size), scene.fields[i].name);
    EXPECT_THAT(fields.mark_x_px[i], testing::NanSensitiveDoubleEq(measured(image, "mark_x_px", {{"field", i}})));
    EXPECT_THAT(fields.mark_y_px[i], testing::NanSensitiveDoubleEq(measured(image, "mark_y_px", {{"field", i}})));
    for (const auto& [direction, value] :
         {std::pair("tangential", fields.tangential[i]), {"sagittal", fields.sagittal[i]}})
      EXPECT_EQ(value, measured(image, "field_mtf", {{"field", i}, {"lp_per_mm", 25}, {"direction", direction}}));
  }
}

TEST(FieldMeasures, RejectWrongArguments) {
  const auto failure = [](const std::string& name, const Json& arguments, const SceneFacts& scene) -> std::string {
    try {
      const images::Image image(480, 360, 0.5F);
      measure(image, image, scene, name, arguments.dump());
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const SceneFacts scene = scene_with_fields();
  EXPECT_THAT(failure("field_mtf", {{"field", "middle"}, {"cycles_per_pixel", 0.1}}, scene),
              HasSubstr("unknown field 'middle'; fields: centre, "));
  EXPECT_THAT(failure("field_mtf", Json::object(), scene), HasSubstr("either 'cycles_per_pixel' or 'lp_per_mm'"));
  EXPECT_THAT(failure("field_mtf", {{"cycles_per_pixel", 0.1}, {"direction", "radial"}}, scene),
              HasSubstr("allowed: tangential, sagittal"));
  EXPECT_THAT(failure("field_mtf", {{"lp_per_mm", 300}}, scene), HasSubstr("more than one cycle"));
  EXPECT_THAT(failure("mark_x_px", Json::object(), scene), HasSubstr("missing key 'field'"));
  EXPECT_THAT(failure("field_mtf", {{"cycles_per_pixel", 0.1}}, SceneFacts()), HasSubstr("no 'fields'"));
}

}  // namespace
}  // namespace relign::trials
