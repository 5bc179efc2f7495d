// What a lens file may get wrong, each with its place.
#include "optics/prescription.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "lens_under_test.h"

namespace relign::optics {
namespace {

using testing::HasSubstr;

std::string complaint(const std::string& from, const std::string& to) {
  std::string text = read_file(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/lens.json");
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  try {
    read_prescription(JsonSource::from_text(text, "lens.json"));
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "accepted";
}

TEST(Prescription, ReadsThePapersLens) {
  const Prescription& lens = relign_od();
  ASSERT_EQ(lens.elements.size(), 4u);
  EXPECT_EQ(lens.elements[2].name, "L3");
  EXPECT_DOUBLE_EQ(1 / lens.elements[1].faces[0].curvature, -65.83880);
  EXPECT_EQ(lens.elements[1].faces[1].index_after, 1);
  EXPECT_EQ(lens.aperture_stop().opening_radius_mm, 1.367413);
  ASSERT_TRUE(lens.mount.has_value());
  EXPECT_EQ(lens.mount->bore_radius_mm, 4.91);
}

TEST(Prescription, EveryMistakeHasItsPlace) {
  EXPECT_THAT(complaint("\"index_after\": 1.487439", "\"index_after\": 0.9"),
              HasSubstr("lens.json:12:58: /elements/0/faces/0/index_after: expected a number from 1 to 5, found 0.9"));
  EXPECT_THAT(complaint("\"index_after\": 1.487439, ", ""), HasSubstr("the key \"index_after\" is missing"));
  EXPECT_THAT(complaint("\"radius_mm\": 2.95545", "\"radius_mm\": 2.8"),
              HasSubstr("larger than the sphere's radius 2.8"));
  EXPECT_THAT(complaint("\"radius_mm\": 2.95545", "\"radius_mm\": 0"), HasSubstr("write null for a plane"));
  EXPECT_THAT(complaint("\"z_mm\": 12.577042", "\"z_mm\": 10.6"), HasSubstr("does not come after the one before it"));
  EXPECT_THAT(complaint("\"z_mm\": 12.877042", "\"z_mm\": 12.6"), HasSubstr("accepted"));
  EXPECT_THAT(complaint("\"radius_mm\": 8.08098", "\"radius_mm\": -3.5"),
              HasSubstr("the face crosses the one before it"));
  EXPECT_THAT(complaint("\"z_mm\": 10.363930", "\"z_mm\": 11"), HasSubstr("lies inside the glass of L2"));
  EXPECT_THAT(complaint(", \"aperture\": true", ""), HasSubstr("exactly one stop must say"));
  EXPECT_THAT(complaint("\"opening_radius_mm\": 2.77", "\"opening_radius_mm\": 5"),
              HasSubstr("larger than the mount's bore"));
  EXPECT_THAT(complaint("\"name\": \"L2\"", "\"name\": \"L1\""), HasSubstr("the name 'L1' stands twice"));
  EXPECT_THAT(complaint("\"stops\"", "\"stop\""), HasSubstr("unknown key \"stop\"; did you mean 'stops'?"));
  EXPECT_THAT(complaint("\"format\": 1", "\"format\": 2"), HasSubstr("expected an integer from 1 to 1, found 2"));
  EXPECT_THAT(complaint("\"image_z_mm\": 20.587550", "\"image_z_mm\": 17"), HasSubstr("lies before the last face"));
  EXPECT_THAT(complaint("\"elements\": [", "\"elements\": [], \"x\": ["), HasSubstr("at least one entry"));
}

}  // namespace
}  // namespace relign::optics
