#include <gtest/gtest.h>

#include "base/error.h"
#include "base/json_source.h"
#include "plugin_host/objects.h"

namespace relign {
namespace {

Json draw(std::uint64_t seed, const char* scene) {
  plugin_host::Catalog catalog;
  catalog.add(std::filesystem::path(RELIGN_PLUGIN_DIR) / "none");
  plugin_host::NoiseLevel level(catalog.resolve_or_throw(plugin_host::Kind::noise_level, "none"), {});
  return Json::parse(level.draw(seed, scene));
}

TEST(None, DrawsNominalPoseIdentityAndNoOffsets) {
  const Json expected = {
      {"start", {0.5, 0.25}}, {"distortion", {{1.0, 0.0}, {0.0, 1.0}}}, {"elements", Json::object()}};
  const char* scene = R"({"axes": [{}, {}], "nominal_pose": [0.5, 0.25], "elements": ["L1"]})";
  EXPECT_EQ(draw(1, scene), expected);
  EXPECT_EQ(draw(77, scene), expected);
}

TEST(None, AcceptsStationWithoutNominalPose) {
  EXPECT_EQ(draw(1, R"({"axes": [{}, {}, {}]})")["start"], Json({0.5, 0.5, 0.5}));
  EXPECT_THROW(draw(1, "{}"), Error);
}

}  // namespace
}  // namespace relign
