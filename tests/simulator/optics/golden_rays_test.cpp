// The double tracer against rays traced by Optiland: nominal, and with two displaced elements.
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

TEST(GoldenRays, MatchOptilandToTenDigits) {
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

// Lenses of catalogue glass; element offsets in the file's convention: Ry Rx about their front vertices.
class GoldenRaysOfDesigns : public testing::TestWithParam<std::string> {};

TEST_P(GoldenRaysOfDesigns, MatchOptilandToTenDigits) {
  const auto source = JsonSource::from_file(std::string(RELIGN_TEST_DATA) + "/golden_rays_relign4.json");
  const Prescription lens =
      read_prescription(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/" + GetParam() + "/lens.json");
  const Json* golden = nullptr;
  for (const Json& design : source.root().at("designs"))
    if (design.at("name") == GetParam()) golden = &design.at("golden_rays");
  ASSERT_NE(golden, nullptr);
  std::vector<Motion> placements;
  constexpr double kDegrees = 57.29577951308232;
  for (std::size_t e = 0; e < lens.elements.size(); ++e) {
    const Json& off = golden->at("perturbation").at(e);
    const auto value = [&](const char* key) { return off.at(key).get<double>(); };
    const Vec3 vertex{0, 0, lens.elements[e].faces.front().z_mm};
    Motion placement;
    placement.rotation = product(rotation_of_degrees(0, kDegrees * value("tilt_y_rad")),
                                 rotation_of_degrees(kDegrees * value("tilt_x_rad"), 0));
    placement.translation = vertex - turn(placement.rotation, vertex) + Vec3{value("dx"), value("dy"), value("dz")};
    placements.push_back(placement);
  }
  const auto vector = [](const Json& v) { return Vec3{v.at(0), v.at(1), v.at(2)}; };
  const auto length = [](const Vec3& v) { return std::sqrt(dot(v, v)); };
  double worst = 0;
  std::size_t compared = 0;
  for (const char* kind : {"nominal", "perturbed"}) {
    const bool nominal = std::string(kind) == "nominal";
    const Assembly assembly = nominal ? Assembly(lens) : Assembly::placed(lens, placements);
    for (const Json& ray : golden->at(kind)) {
      const TracedRay traced = trace(assembly, {vector(ray.at("start")), vector(ray.at("direction"))}, Apertures::none);
      ASSERT_TRUE(traced.passed) << traced.lost_at;
      // The file lists the stop among the surfaces; we have no hit there.
      std::vector<Vec3> hits;
      const double stop = lens.aperture_stop().z_mm;
      for (const Json& hit : ray.at("hits"))
        if (std::fabs(hit.at(2).get<double>() - stop) > 1e-9) hits.push_back(vector(hit));
      ASSERT_EQ(hits.size(), traced.hits.size());
      for (std::size_t i = 0; i < hits.size(); ++i) worst = std::max(worst, length(hits[i] - traced.hits[i]));
      worst = std::max(worst, std::hypot(ray.at("image").at(0).get<double>() - traced.image.x,
                                         ray.at("image").at(1).get<double>() - traced.image.y));
      worst = std::max(worst, length(vector(ray.at("direction_out")) - traced.exit_direction));
      ++compared;
    }
  }
  EXPECT_EQ(compared, 16u);
  EXPECT_LT(worst, 1e-10) << "mm";
}

INSTANTIATE_TEST_SUITE_P(Designs, GoldenRaysOfDesigns, testing::Values("relign4", "relign4_telecentric"),
                         [](const auto& design) { return design.param; });

TEST(GoldenRays, DifferWithoutOffsets) {
  // The same rays through the perfect lens must differ where the golden ray had displaced elements.
  const auto source = JsonSource::from_file(std::string(RELIGN_TEST_DATA) + "/golden_rays_relign_od.json");
  for (const RayRequest& request : read_rays(source, relign_od())) {
    if (request.elements.empty()) continue;
    const TracedRay perfect = trace(Assembly(relign_od()), request.ray, Apertures::none);
    const TracedRay off = trace(Assembly(relign_od(), request.elements), request.ray, Apertures::none);
    EXPECT_GT(std::hypot(perfect.image.x - off.image.x, perfect.image.y - off.image.y), 1e-4);
  }
}

TEST(Trace, ReportsWhereARayIsLost) {
  const Assembly lens(relign_od());
  EXPECT_EQ(trace(lens, {{0, 4.5, -1}, {0, 0, 1}}, Apertures::listing).lost_at, "L1 front: outside the clear aperture");
  EXPECT_EQ(trace(lens, {{0, 0.9, -1}, {0, 0, 1}}, Apertures::mesh).lost_at, "aperture stop: outside the opening");
  EXPECT_EQ(trace(lens, {{0, 11, -1}, {0, 0, 1}}, Apertures::none).lost_at, "L1 front: misses the face");
  EXPECT_EQ(trace(lens, {{0, 0, 30}, {0, 0, -1}}, Apertures::none).lost_at,
            "the start: the ray must travel towards +z");
}

TEST(RayFile, ReportsMissingKeys) {
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
