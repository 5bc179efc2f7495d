#include "report/svg_chart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/files.h"
#include "report/assets.h"
#include "report/made_results.h"

namespace relign::report {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

const double kNone = std::nan("");

std::size_t count_in(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

std::vector<std::string> texts(const ChartScale& scale, int marks, bool whole = false) {
  std::vector<std::string> all;
  for (const auto& mark : scale.marks(marks, whole)) all.push_back(mark.second);
  return all;
}

TEST(ChartScaleTest, MarksAreRoundNumbers) {
  EXPECT_THAT(texts({0, 1, false, 0, 100}, 5), ElementsAre("0", "0.2", "0.4", "0.6", "0.8", "1"));
  EXPECT_THAT(texts({0, 3, false, 0, 100}, 10, true), ElementsAre("0", "1", "2", "3")) << "integers only";
  EXPECT_THAT(texts({0.01, 1, true, 0, 100}, 5), ElementsAre("0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"));
  EXPECT_THAT(texts({1e-4, 1, true, 0, 100}, 5), ElementsAre("1e-04", "0.001", "0.01", "0.1", "1"));
  EXPECT_THAT(texts({6, 17, true, 0, 100}, 4), ElementsAre("10", "15")) << "less than a decade";
}

TEST(ChartScaleTest, PositionsFollowTheAxis) {
  const ChartScale log(0.01, 100, true, 0, 400);
  EXPECT_DOUBLE_EQ(log(1), 200);
  EXPECT_DOUBLE_EQ(log(0), 0) << "zero is clipped to the axis";
  EXPECT_DOUBLE_EQ(log(1000), 400);
  EXPECT_TRUE(std::isnan(log(kNone)));
  EXPECT_DOUBLE_EQ(ChartScale(0, 10, false, 300, 0)(2.5), 225) << "upwards";
}

TEST(ChartScaleTest, LabelsDoNotOverlapAndFirstOnesHavePriority) {
  EXPECT_THAT(spread_labels({50, 51, 10}, 0, 100, 12), ElementsAre(50, 62, 10));
  EXPECT_THAT(spread_labels({99, 100}, 0, 100, 12), ElementsAre(88, 100));
  const std::vector<double> crowded = spread_labels({5, 5, 5, 5}, 0, 24, 12);
  EXPECT_EQ(crowded[2], 24);
  EXPECT_TRUE(std::isnan(crowded[3])) << "no room";
}

Chart chart_of(const std::string& name) {
  Chart chart;
  chart.title = "made " + name;
  chart.x = {"images", true, true, {}};
  chart.y = {"error", true, false, {}};
  chart.series = {{name, 0, Drawn::line, {{1, 0.1, 0.08, 0.12}, {2, 0.05}, {4, 0.02, 0.01, 0.03}}},
                  {"steps", 8, Drawn::steps, {{1, 0.1}, {3, 0.05}}},
                  {"oracle", kOracleStyle, Drawn::line, {{1, 0.01}, {4, kNone}}}};
  chart.levels = {{"floor", 0.012, false}, {"unknown", kNone, true}};
  return chart;
}

TEST(SvgChart, DrawsLinesBandsStepsAndLevels) {
  const std::string svg = chart_svg(chart_of("method"));
  EXPECT_EQ(svg, chart_svg(chart_of("method"))) << "equal charts, equal bytes";
  EXPECT_THAT(svg, HasSubstr("xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_EQ(count_in(svg, "fill-opacity=\"0.14\""), 1u) << "one band";
  EXPECT_THAT(svg, HasSubstr("color=\"#0072B2\""));
  EXPECT_THAT(svg, HasSubstr("stroke-dasharray=\"8 4\"")) << "style 8: the second colour, dashed";
  EXPECT_THAT(svg, HasSubstr(">floor</text>"));
  EXPECT_THAT(svg, Not(HasSubstr("unknown")));
  for (const char* bad : {"nan", "inf", "var("}) EXPECT_THAT(svg, Not(HasSubstr(bad))) << bad;
}

TEST(SvgChart, SpecificationHasTheSameNumbers) {
  const Json chart = chart_json(chart_of("method"));
  EXPECT_EQ(chart["x"], Json({{"title", "images"}, {"log", true}, {"whole", true}}));
  ASSERT_EQ(chart["series"].size(), 3u);
  const Json& line = chart["series"][0];
  EXPECT_EQ(line["drawn"], "line");
  EXPECT_EQ(line["y"], Json({0.1, 0.05, 0.02}));
  EXPECT_EQ(line["low"], Json({0.08, nullptr, 0.01}));
  EXPECT_FALSE(chart["series"][1].contains("low")) << "no intervals";
  EXPECT_EQ(chart["series"][2]["y"], Json({0.01, nullptr}));
  EXPECT_EQ(chart["levels"], Json::array({{{"label", "floor"}, {"y", 0.012}, {"dotted", false}}}));
  EXPECT_EQ(chart_json(Chart{})["series"], Json::array());
}

// The y position of the text with this content.
double height_of(const std::string& svg, const std::string& text) {
  const std::size_t end = svg.find(">" + text + "</text>");
  const std::size_t y = svg.rfind(" y=\"", end);
  return end == std::string::npos || y == std::string::npos ? kNone : std::stod(svg.substr(y + 4));
}

TEST(SvgChart, SeparatesLabelsOfCloseLevels) {
  Chart chart = chart_of("method");
  chart.levels = {{"upper", 0.0121, true}, {"lower", 0.012, false}};
  const std::string close = chart_svg(chart);
  EXPECT_GT(height_of(close, "lower"), height_of(close, "upper") + 10);
  std::swap(chart.levels[0], chart.levels[1]);
  EXPECT_GT(height_of(chart_svg(chart), "lower"), height_of(close, "upper") + 10) << "in either order";
  chart.levels[1].y = 0.05;
  EXPECT_LT(height_of(chart_svg(chart), "lower"), height_of(close, "lower")) << "otherwise above its line";
}

TEST(SvgChart, AcceptsEmptyCharts) {
  EXPECT_THAT(chart_svg(Chart{}), HasSubstr("</svg>"));
  Chart chart = chart_of("a");
  for (ChartSeries& series : chart.series)
    for (ChartPoint& point : series.points) point.y = 0;  // not on a logarithmic axis
  chart.levels.clear();
  EXPECT_THAT(chart_svg(chart), Not(HasSubstr("nan")));
  chart.x.categories = {"one"};
  EXPECT_THAT(chart_svg(chart), HasSubstr(">one</text>"));
}

TEST(SvgChart, EscapesNames) {
  Chart chart = chart_of(kHostile);
  chart.title = chart.x.title = chart.levels[0].label = kHostile;
  const std::string svg = chart_svg(chart);
  EXPECT_THAT(svg, Not(HasSubstr("<img")));
  EXPECT_THAT(svg, Not(HasSubstr("<script")));
  EXPECT_THAT(svg, Not(HasSubstr("\x1b")));
  EXPECT_GT(count_in(svg, "&lt;img"), 3u);
  const std::string csv = chart_csv(chart);
  EXPECT_THAT(csv, Not(HasSubstr("\x1b")));
  EXPECT_THAT(csv, HasSubstr("\"\"\"><img")) << "quoted";
}

TEST(SvgChart, CsvHasTheSameNumbers) {
  EXPECT_EQ(chart_csv(chart_of("=1+1,")),
            "series,images,error,low,high\n"
            "\"'=1+1,\",1,0.1,0.08,0.12\n\"'=1+1,\",2,0.05,,\n\"'=1+1,\",4,0.02,0.01,0.03\n"
            "steps,1,0.1,,\nsteps,3,0.05,,\noracle,1,0.01,,\nfloor,,0.012,,\n");
}

// The colours are defined in three places: files, the page's style, and the script, which saves charts.
TEST(SvgChart, PageAndScriptUseTheSameColours) {
  for (const std::string& colour : series_colours()) {
    EXPECT_THAT(std::string(assets::page_css()), HasSubstr(": " + colour + ";"));
    EXPECT_THAT(std::string(assets::page_js()), HasSubstr("'" + colour + "'"));
  }
}

}  // namespace
}  // namespace relign::report
