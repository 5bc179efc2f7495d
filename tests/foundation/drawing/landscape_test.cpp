// Landscapes of known functions: contours, the layout, the page and the table.
#include "drawing/landscape.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
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
    LandscapePlane plane{across, up, {}, {}};
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

Landscape sloped(int points) {
  Landscape landscape = cone(3, points);
  for (LandscapePlane& plane : landscape.planes)
    for (std::size_t place = 0; place < plane.values.size(); ++place) {
      const double u = static_cast<double>(place % static_cast<std::size_t>(points)) / (points - 1);
      const double v = static_cast<double>(place / static_cast<std::size_t>(points)) / (points - 1);
      if (has_arrow(points, place)) plane.slopes[place] = {u - 0.5, v - 0.25};
    }
  return landscape;
}

TEST(Landscape, ArrowsAreAtMostNineByNineInsideThePlane) {
  for (int points = 3; points <= 501; ++points) {
    std::set<int> rows, columns;
    for (int place = 0; place < points * points; ++place)
      if (has_arrow(points, static_cast<std::size_t>(place)))
        rows.insert(place / points), columns.insert(place % points);
    EXPECT_EQ(rows, columns);
    EXPECT_GE(rows.size(), std::min<std::size_t>(5, static_cast<std::size_t>(points) - 2)) << points;
    EXPECT_LE(rows.size(), 9U) << points;
    EXPECT_GT(*rows.begin(), 0);
    EXPECT_LT(*rows.rbegin(), points - 1);
  }
}

// The first line of each arrow is its shaft, from its tail to its tip.
TEST(Landscape, ArrowsPointDownhillAndDoNotTouch) {
  for (const int points : {3, 12, 21, 41}) {
    const Landscape landscape = sloped(points);
    const std::string svg = landscape_svg(landscape);
    EXPECT_THAT(svg, HasSubstr("towards lower values"));
    EXPECT_THAT(landscape_svg(cone(3, points)), Not(HasSubstr("towards lower values")));
    const Rectangle panel = LandscapeLayout(3).panel(0, 1);
    std::vector<Segment> shafts;
    const std::regex line("M([0-9.]+) ([0-9.]+)L([0-9.]+) ([0-9.]+)");
    std::size_t from = svg.find("<g class=\"panel\">"), end = svg.find("</g>", from);
    from = svg.rfind("<path", svg.find("stroke-width=\"1.1\"", from));
    const std::string arrows = svg.substr(from, svg.find("/>", from) - from);
    std::sregex_iterator each(arrows.begin(), arrows.end(), line);
    for (int number = 0; each != std::sregex_iterator(); ++each, ++number)
      if (number % 3 == 0)
        shafts.push_back(
            {{std::stod((*each)[1]), std::stod((*each)[2])}, {std::stod((*each)[3]), std::stod((*each)[4])}});
    ASSERT_LT(from, end);
    ASSERT_FALSE(shafts.empty());
    double longest = 0;
    for (std::size_t i = 0; i < shafts.size(); ++i) {
      const auto& [tail, tip] = shafts[i];
      const auto middle = [](const Segment& s) {
        return Point{(s.first.x + s.second.x) / 2, (s.first.y + s.second.y) / 2};
      };
      const double u = (middle(shafts[i]).x - panel.x) / panel.width - 0.5;
      const double v = 1 - (middle(shafts[i]).y - panel.y) / panel.height - 0.25;
      const double length = std::hypot(tip.x - tail.x, tip.y - tail.y);
      EXPECT_NEAR((tip.x - tail.x) / length, -u / std::hypot(u, v), 0.03);
      EXPECT_NEAR((tip.y - tail.y) / length, v / std::hypot(u, v), 0.03);
      longest = std::max(longest, length);
      for (std::size_t j = 0; j < i; ++j) {
        const Point here = middle(shafts[i]), there = middle(shafts[j]);
        EXPECT_GT(
            std::hypot(here.x - there.x, here.y - there.y),
            (length + std::hypot(shafts[j].second.x - shafts[j].first.x, shafts[j].second.y - shafts[j].first.y)) / 2);
      }
    }
    EXPECT_GT(longest, 0.08 * panel.width);
  }
}

TEST(Landscape, TableHasGradientsWhereArrowsAre) {
  const std::string table = landscape_table(sloped(5));
  EXPECT_THAT(table, HasSubstr("unit_1,unit_2,RMSE,gradient_1,gradient_2\n"));
  EXPECT_THAT(table, HasSubstr("a0,a1,-1,-1,0,0,mm,mm,0.5590169943749475,,\n"));
  EXPECT_THAT(table, HasSubstr("a0,a1,0.5,0.5,0.75,0.75,mm,mm,0.5590169943749475,0.25,0.5\n"));
}

}  // namespace
}  // namespace relign::drawing
