// The drawing of a lens: an approved picture, and rays drawn as traced. After an intended change:
//   RELIGN_UPDATE_GOLDEN=1 build/release/tests/test_drawing_lens
#include "lens_drawing/lens_drawing.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <regex>

#include "base/files.h"
#include "optics/lens_under_test.h"

namespace relign::drawing {
namespace {

using optics::Assembly;
using optics::relign_od;

LensPicture picture_of(const Assembly& assembly, const std::vector<double>& fields, int rays) {
  LensPicture picture;
  picture.assembly = &assembly;
  picture.title = "a <lens>";
  picture.subtitle = "for tests";
  for (const double field : fields) {
    DrawnFan fan;
    fan.label = std::to_string(static_cast<int>(field)) + " deg";
    fan.series = picture.fans.size();
    fan.rays = optics::ray_fan(assembly, field, {}, rays);
    picture.fans.push_back(fan);
  }
  return picture;
}

std::vector<Point> points_of(const std::string& list) {
  std::vector<Point> points;
  static const std::regex pair("(-?[0-9.]+),(-?[0-9.]+)");
  for (std::sregex_iterator at(list.begin(), list.end(), pair), end; at != end; ++at)
    points.push_back({std::stod((*at)[1]), std::stod((*at)[2])});
  return points;
}

// The points of every polyline in groups of one class, in order.
std::vector<std::vector<Point>> lines_in(const std::string& svg, const std::string& group) {
  std::vector<std::vector<Point>> lines;
  static const std::regex line("<polyline points=\"([^\"]*)\"");
  const std::string opening = "<g class=\"" + group + "\">";
  for (std::size_t at = svg.find(opening); at != std::string::npos; at = svg.find(opening, at + 1)) {
    const std::string part = svg.substr(at, svg.find("</g>", at) - at);
    for (std::sregex_iterator found(part.begin(), part.end(), line), end; found != end; ++found)
      lines.push_back(points_of((*found)[1]));
  }
  return lines;
}

TEST(LensDrawing, MatchesApprovedDrawing) {
  const Assembly assembly(relign_od(), {{"L2", {{0, 0.3, 0}, {3, 1}}}});
  const std::string svg = lens_svg(picture_of(assembly, {0, 42}, 3));
  const std::filesystem::path file = std::filesystem::path(RELIGN_TEST_DATA) / "lens_drawing.svg";
  if (std::getenv("RELIGN_UPDATE_GOLDEN") != nullptr) write_file_atomically(file, svg);
  EXPECT_EQ(svg, read_file(file)) << "approve an intended change with RELIGN_UPDATE_GOLDEN=1";
}

TEST(LensDrawing, RaysMatchTheTrace) {
  const Assembly assembly(relign_od(), {{"L3", {{0, 0.1, 0}, {2, 0}}}});
  for (const bool vertical : {false, true}) {
    LensPicture picture = picture_of(assembly, {0, 20, 42}, 5);
    picture.vertical = vertical;
    const std::string svg = lens_svg(picture);
    // The image plane and the axis give the scale: their places in mm are known from the trace alone.
    const std::vector<std::vector<Point>> axis = lines_in(svg, "axis"), image = lines_in(svg, "image");
    const std::vector<std::vector<Point>> rays = lines_in(svg, "rays");
    ASSERT_EQ(axis.size(), 1U);
    ASSERT_EQ(image.size(), 1U);
    ASSERT_EQ(rays.size(), 15U);
    const auto along = [&](const Point& point) { return vertical ? point.y : point.x; };
    const auto across = [&](const Point& point) { return vertical ? point.x : -point.y; };
    const double axis_at = across(axis[0][0]);
    double highest = 0;
    for (const DrawnFan& fan : picture.fans)
      for (const optics::FanRay& ray : fan.rays) highest = std::max(highest, std::fabs(ray.traced.image.y));
    const double scale = (across(image[0][1]) - axis_at) / (1.1 * highest);  // the image is drawn a tenth higher
    const double first_vertex = along(image[0][0]) - scale * relign_od().image_z_mm;
    std::size_t number = 0;
    for (const DrawnFan& fan : picture.fans)
      for (const optics::FanRay& ray : fan.rays) {
        const std::vector<Point>& line = rays[number++];
        ASSERT_EQ(line.size(), ray.traced.hits.size() + 2);
        for (std::size_t k = 0; k < ray.traced.hits.size(); ++k) {
          EXPECT_NEAR(along(line[k + 1]), first_vertex + scale * ray.traced.hits[k].z, 0.2);
          EXPECT_NEAR(across(line[k + 1]), axis_at + scale * ray.traced.hits[k].y, 0.2);
        }
        EXPECT_NEAR(along(line.back()), along(image[0][0]), 0.011);
        EXPECT_NEAR(across(line.back()), axis_at + scale * ray.traced.image.y, 0.2);
      }
  }
}

TEST(LensDrawing, SectionsFollowElementPlacement) {
  const optics::Face& face = relign_od().elements[1].faces[1];
  const Assembly assembly(relign_od(), {{"L2", {{0.2, -0.3, 0.1}, {4, 5}}}});
  const optics::Motion& placement = assembly.placement(1);
  const auto section = face_section(face, placement, 21);
  ASSERT_EQ(section.size(), 21U);
  const double radius = 1 / face.curvature;
  const optics::Vec3 centre = placement.point({0, 0, face.z_mm + radius});
  for (const optics::Vec3& place : section) {
    EXPECT_NEAR(place.x, 0, 1e-9);
    const optics::Vec3 arm = place - centre;
    EXPECT_NEAR(std::sqrt(dot(arm, arm)), std::fabs(radius), 1e-9);
    const optics::Vec3 own = optics::inverse(placement).point(place);
    EXPECT_LE(own.x * own.x + own.y * own.y, face.clear_radius_mm * face.clear_radius_mm + 1e-9);
  }
  // From rim to rim.
  EXPECT_LT(optics::inverse(placement).point(section.front()).y, -0.9 * face.clear_radius_mm);
  EXPECT_GT(optics::inverse(placement).point(section.back()).y, 0.9 * face.clear_radius_mm);
}

TEST(LensDrawing, EscapesText) {
  const std::string svg = lens_svg(picture_of(Assembly(relign_od()), {0}, 1));
  EXPECT_THAT(svg, testing::HasSubstr("a &lt;lens&gt;"));
  EXPECT_THAT(svg, testing::Not(testing::HasSubstr("<lens>")));
}

}  // namespace
}  // namespace relign::drawing
