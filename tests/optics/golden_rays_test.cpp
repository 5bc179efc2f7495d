// The double tracer against rays that Optiland traced: nominal, and with two elements off.
#include <gtest/gtest.h>

#include <cmath>

#include "lens_under_test.h"
#include "optics/ray_file.h"
#include "optics/trace.h"

namespace relign::optics {
namespace {

double distance(const Json& a, const Json& b) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += std::pow(a.at(i).get<double>() - b.at(i).get<double>(), 2);
  return std::sqrt(sum);
}

TEST(GoldenRays, AgreeToTenDigits) {
  const auto source = JsonSource::from_file(std::string(RELIGN_TEST_DATA) + "/golden_rays_relign_od.json");
  const auto requests = read_rays(source, relign_od());
  ASSERT_EQ(requests.size(), 12u);
  double worst = 0;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const Json& golden = source.root().at("rays").at(i);
    const Assembly assembly(relign_od(), requests[i].elements);
    const TracedRay traced = trace(assembly, requests[i].ray, Apertures::none);
    ASSERT_TRUE(traced.passed) << i << ": " << traced.lost_at;
    const Json ours = traced_to_json(requests[i], traced);
    ASSERT_EQ(ours.at("hits_mm").size(), golden.at("hits_mm").size());
    for (std::size_t face = 0; face < traced.hits.size(); ++face)
      worst = std::max(worst, distance(ours.at("hits_mm").at(face), golden.at("hits_mm").at(face)));
    worst = std::max(worst, distance(ours.at("image_mm"), golden.at("image_mm")));
    worst = std::max(worst, distance(ours.at("exit_direction"), golden.at("exit_direction")));
  }
  EXPECT_LT(worst, 1e-10) << "mm";
}

TEST(GoldenRays, OffsetsMatter) {
  // The same rays through the perfect lens must not agree where the golden ray had elements off.
  const auto source = JsonSource::from_file(std::string(RELIGN_TEST_DATA) + "/golden_rays_relign_od.json");
  for (const RayRequest& request : read_rays(source, relign_od())) {
    if (request.elements.empty()) continue;
    const TracedRay perfect = trace(Assembly(relign_od()), request.ray, Apertures::none);
    const TracedRay off = trace(Assembly(relign_od(), request.elements), request.ray, Apertures::none);
    EXPECT_GT(std::hypot(perfect.image.x - off.image.x, perfect.image.y - off.image.y), 1e-4);
  }
}

TEST(Trace, SaysWhereARayIsLost) {
  const Assembly lens(relign_od());
  EXPECT_EQ(trace(lens, {{0, 4.5, -1}, {0, 0, 1}}, Apertures::listing).lost_at, "L1 front: outside the clear radius");
  EXPECT_EQ(trace(lens, {{0, 0.9, -1}, {0, 0, 1}}, Apertures::mesh).lost_at, "aperture stop: outside the opening");
  EXPECT_EQ(trace(lens, {{0, 11, -1}, {0, 0, 1}}, Apertures::none).lost_at, "L1 front: misses the face");
  EXPECT_EQ(trace(lens, {{0, 0, 30}, {0, 0, -1}}, Apertures::none).lost_at,
            "the start: the ray does not travel towards +z");
}

TEST(RayFile, NamesWhatIsMissing) {
  const auto source =
      JsonSource::from_text(R"({"rays": [{"start_mm": [1, 2], "elements": {"L9": {}}, "colour": 1}]})", "r.json");
  try {
    read_rays(source, relign_od());
    FAIL();
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("the key \"direction\" is missing"), std::string::npos) << text;
    EXPECT_NE(text.find("expected a list of 3 numbers, found [1,2]"), std::string::npos) << text;
    EXPECT_NE(text.find("unknown key \"L9\""), std::string::npos) << text;
    EXPECT_NE(text.find("unknown key \"colour\""), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace relign::optics
