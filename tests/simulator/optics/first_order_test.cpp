// First-order data against every digit that CODE V prints, and the distortion of the chief ray.
#include "optics/first_order.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "lens_under_test.h"
#include "named_values.h"
#include "optics/trace.h"

namespace relign::optics {
namespace {

TEST(FirstOrder, MatchesEveryDigitOfCodeV) {
  const FirstOrder data = first_order(relign_od());
  const double half = 0.5e-4;  // of the last printed digit
  EXPECT_NEAR(data.focal_length, 2.8950, half);
  EXPECT_NEAR(data.back_focal_length, 3.4933, half);
  EXPECT_NEAR(data.front_focal_length, 4.8298, half);
  EXPECT_NEAR(data.f_number, 2.1000, half);
  EXPECT_NEAR(data.image_distance, 3.4458, half);
  EXPECT_NEAR(data.overall_length, 17.1418, half);
  EXPECT_NEAR(data.paraxial_image_height, 2.6113, half);
  EXPECT_NEAR(data.entrance_pupil_diameter, 1.3786, half);
  EXPECT_NEAR(data.entrance_pupil_z, 5.8206, half);
  EXPECT_NEAR(data.exit_pupil_diameter, 4.0284, half);
  EXPECT_NEAR(data.exit_pupil_from_last, -4.9663, half);
}

TEST(FirstOrder, MatchesOptiland) {
  // Values computed with Optiland, from the notes of the scene.
  const FirstOrder data = first_order(relign_od());
  EXPECT_NEAR(data.focal_length, 2.89501, 0.5e-5);
  EXPECT_NEAR(data.entrance_pupil_diameter, 1.37858, 0.5e-5);
  EXPECT_NEAR(data.entrance_pupil_z, 5.82055, 0.5e-5);
  EXPECT_NEAR(data.exit_pupil_diameter, 4.02837, 0.5e-5);
  EXPECT_NEAR(data.exit_pupil_z - relign_od().image_z_mm, -8.41205, 0.5e-5);
}

TEST(FirstOrder, MatchesPublishedValuesOfLensFile) {
  const std::map<std::string, double> ours = named_values(first_order(relign_od()));
  ASSERT_EQ(relign_od().published.size(), ours.size());
  for (const Published& published : relign_od().published)
    EXPECT_NEAR(published.value, ours.at(published.name), 0.5e-4) << published.name;
}

TEST(Distortion, MatchesCodeVAtFullField) {
  // CODE V prints -27.2 %; Optiland gave -27.18 %.
  EXPECT_NEAR(100 * distortion(relign_od(), 42.05), -27.18, 0.01);
  EXPECT_NEAR(distortion(relign_od(), 0.01), 0, 1e-6);
  EXPECT_THROW(distortion(relign_od(), 89), Error);
}

}  // namespace
}  // namespace relign::optics
