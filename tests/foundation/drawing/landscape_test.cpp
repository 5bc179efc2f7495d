// Landscapes of known functions: contours, the layout, the page and the table.
#include "drawing/landscape.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "drawing/contours.h"

namespace relign::drawing {
namespace {

using testing::HasSubstr;
using testing::Not;

double distance(double u, double v) { return std::hypot(u - 0.5, v - 0.25); }

Landscape cone(std::size_t axes, int points) {
  Landscape landscape;
  landscape.title = "a </script><b>cone";
  landscape.subtitle = "for tests";
  landscape.measure = "RMSE";
  landscape.points = points;
  for (std::size_t axis = 0; axis < axes; ++axis)
    landscape.axes.push_back({"a" + std::to_string(axis), "mm", -1, 1, 0.5});
  for (const auto& [across, up] : plane_axes(axes)) {
    LandscapePlane plane{across, up, {}};
    for (int row = 0; row < points; ++row)
      for (int column = 0; column < points; ++column)
        plane.values.push_back(distance(column / (points - 1.0), row / (points - 1.0)));
    landscape.planes.push_back(plane);
  }
  return landscape;
}

TEST(Contours, FollowTheLevel) {
  const int points = 41;
  const Landscape landscape = cone(2, points);
  const std::vector<Segment> lines = contour(landscape.planes[0].values, points, points, 0.2);
  EXPECT_GT(lines.size(), 30U);
  double length = 0;
  for (const auto& [from, to] : lines) {
    for (const Point& point : {from, to}) EXPECT_NEAR(distance(point.x / 40, point.y / 40), 0.2, 2e-3);
    length += std::hypot(to.x - from.x, to.y - from.y) / 40;
  }
  EXPECT_NEAR(length, 2 * M_PI * 0.2, 0.01);  // a whole circle, once
  EXPECT_TRUE(contour(landscape.planes[0].values, points, points, 5).empty());
}

TEST(Contours, SaddlesDoNotCross) {
  for (const double level : {0.4, 0.6}) {
    const std::vector<Segment> lines = contour({1, 0, 0, 1}, 2, 2, level);  // middle 0.5
    ASSERT_EQ(lines.size(), 2U);
    // Below the middle's value the high corners (0, 0) and (1, 1) are joined, and each line cuts off a low one.
    for (const auto& [from, to] : lines) {
      const double x = (from.x + to.x) / 2, y = (from.y + to.y) / 2;
      EXPECT_EQ((x > 0.5) == (y > 0.5), level > 0.5);
    }
  }
}

TEST(Landscape, IsLogarithmicFromTheResolutionOn) {
  Landscape landscape = cone(2, 5);
  for (double& value : landscape.planes[0].values) value = std::pow(10, 8 * value - 3);  // 0.001 to 1e4
  EXPECT_THAT(landscape_svg(landscape), HasSubstr("contours every "));
  landscape.logarithmic_from = 0.01;
  const std::string svg = landscape_svg(landscape);
  EXPECT_THAT(svg, HasSubstr("contours at factors of "));
  for (const char* tick : {">0.010<", ">1.0<", ">100<"}) EXPECT_THAT(svg, HasSubstr(tick));
  landscape.planes[0].values.assign(25, 0.0);
  EXPECT_THAT(landscape_svg(landscape), Not(HasSubstr("nan")));
}

TEST(LandscapeLayout, PanelsAndLegendDoNotOverlap) {
  for (std::size_t axes = 2; axes <= 7; ++axes) {
    const LandscapeLayout layout(axes);
    std::vector<Rectangle> all = {layout.legend};
    for (const auto& [across, up] : plane_axes(axes)) all.push_back(layout.panel(across, up));
    EXPECT_EQ(all.size(), 1 + axes * (axes - 1) / 2);
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_LE(all[i].x + all[i].width, layout.width);
      EXPECT_LE(all[i].y + all[i].height, layout.height);
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_TRUE(all[i].x >= all[j].x + all[j].width || all[j].x >= all[i].x + all[i].width ||
                    all[i].y >= all[j].y + all[j].height || all[j].y >= all[i].y + all[i].height)
            << axes << " " << i << " " << j;
    }
  }
}

TEST(Landscape, PictureIsDarkestAtTheMinimum) {
  const Landscape landscape = cone(5, 41);
  const LandscapeLayout layout(5);
  const Raster raster = landscape_raster(landscape, 1);
  const auto green = [&](const Point& at) {
    const auto x = static_cast<std::size_t>(at.x), y = static_cast<std::size_t>(at.y);
    return static_cast<int>(raster.rgb[3 * (y * static_cast<std::size_t>(raster.width) + x) + 1]);
  };
  const Rectangle panel = layout.panel(1, 3);
  const auto at = [&](double u, double v) {
    return Point{panel.x + u * panel.width, panel.y + (1 - v) * panel.height};
  };
  EXPECT_LT(green(at(0.63, 0.25)), 80);  // beside the ring
  EXPECT_GT(green(at(0.05, 0.93)), 180);
  EXPECT_GT(green(at(0.05, 0.93)), green(at(0.3, 0.6)));
}

TEST(Landscape, PageContainsValuesAndEscapesText) {
  const std::string page = landscape_page(cone(3, 3));
  EXPECT_THAT(page, Not(HasSubstr("</script><b>")));

  const std::string opening = "id=\"values\">";
  const std::size_t from = page.find(opening) + opening.size();
  const auto data = nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
  ASSERT_EQ(data.at("planes").size(), 3U);
  const Rectangle panel = LandscapeLayout(3).panel(1, 2);
  EXPECT_EQ(data.at("planes").at(2).at("x").get<double>(), panel.x);
  EXPECT_NEAR(data.at("planes").at(2).at("values").at(1).get<double>(), 0.25, 1e-6);  // u 0.5, v 0
}

TEST(Landscape, TableHasOneLinePerValue) {
  std::istringstream table(landscape_table(cone(3, 3)));
  std::vector<std::string> lines;
  for (std::string line; std::getline(table, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 1U + 3 * 9);
  EXPECT_EQ(lines[0], "axis_1,axis_2,value_1,value_2,share_1,share_2,unit_1,unit_2,RMSE");
  EXPECT_EQ(lines[2], "a0,a1,0,-1,0.5,0,mm,mm,0.25");
}

}  // namespace
}  // namespace relign::drawing
