// Rays traced in lanes against rays traced one by one: equal bits, with every instruction set of this processor.
#include "optics/ray_lanes.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <relign/random.hpp>

#include "lens_under_test.h"
#include "optics/ray_block.h"
#include "optics/trace.h"

namespace relign::optics {
namespace {

namespace fs = std::filesystem;

Assembly disturbed(const Prescription& lens, Random& random) {
  std::map<std::string, ElementOffset> offsets;
  for (const Element& element : lens.elements) {
    ElementOffset& offset = offsets[element.name];
    for (double& shift : offset.shift_mm) shift = 0.05 * random.normal();
    for (double& tilt : offset.tilt_deg) tilt = 0.5 * random.normal();
  }
  return Assembly(lens, offsets);
}

// Rays towards the first face, some of them beside it, some away from it. Returns how many passed.
int compare(const Assembly& lens, const char* set, Random& random) {
  const BlockKernels* kernels = block_kernels(set);
  if (!kernels) return -1;
  const LanePath path(lens);
  const Face& first = lens.lens().elements.front().faces.front();
  const double wide = 1.2 * first.clear_radius_mm;
  auto rays = std::make_unique<RayLanes>();
  int passed = 0;
  for (const int count : {kLanes, 1, 13}) {
    Ray starts[kLanes];
    for (int i = 0; i < count; ++i) {
      const double beside = i % 2 ? wide : 0.2 * wide;
      starts[i].start = {beside * random.normal(), beside * random.normal(), first.z_mm - 20 * wide * random.uniform()};
      const Vec3 aim{beside * (2 * random.uniform() - 1), beside * (2 * random.uniform() - 1), first.z_mm};
      starts[i].direction = (i % 17 == 5 ? -1.0 : 1.0) * (aim - starts[i].start);
      const auto& [at, way] = starts[i];
      rays->x[i] = at.x;
      rays->y[i] = at.y;
      rays->z[i] = at.z;
      rays->dx[i] = way.x;
      rays->dy[i] = way.y;
      rays->dz[i] = way.z;
    }
    path.trace(*rays, count, *kernels->lanes);
    for (int i = 0; i < count; ++i) {
      const TracedRay single = trace(lens, starts[i], Apertures::mesh);
      EXPECT_EQ(rays->alive[i] > 0, single.passed) << lens.lens().name << ", " << set << ": " << single.lost_at;
      if (!single.passed || !(rays->alive[i] > 0)) continue;
      ++passed;
      const Vec3& last = single.hits.back();
      EXPECT_TRUE(rays->x[i] == last.x && rays->y[i] == last.y && rays->z[i] == last.z);
      EXPECT_TRUE(rays->dx[i] == single.exit_direction.x && rays->dy[i] == single.exit_direction.y &&
                  rays->dz[i] == single.exit_direction.z);
      EXPECT_EQ(rays->transmittance[i], single.transmittance);
      EXPECT_EQ(rays->path_mm[i], single.path_to_last_mm);
    }
  }
  return passed;
}

void compare_all(const Prescription& lens, Random& random) {
  SCOPED_TRACE(lens.name);
  for (const char* set : {"generic", "avx2", "avx512"}) {
    int passed = 0;
    for (int number = 0; number < 60; ++number) {
      const int here = compare(number == 0 ? Assembly(lens) : disturbed(lens, random), set, random);
      if (here < 0) break;
      passed += here;
    }
    if (!block_kernels(set)) continue;
    EXPECT_GT(passed, 20) << set;
  }
}

TEST(RayLanes, EqualSingleRaysForShippedLenses) {
  Random random(3);
  int lenses = 0;
  for (const auto& entry : fs::directory_iterator(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system")) {
    if (!fs::exists(entry.path() / "lens.json")) continue;
    compare_all(read_prescription(entry.path() / "lens.json"), random);
    ++lenses;
  }
  EXPECT_GE(lenses, 10);
}

TEST(RayLanes, EqualSingleRaysForAspheres) {
  Random random(4);
  compare_all(aspheric_relign_od(), random);
}

TEST(RayLanes, EqualSingleRaysForMirrors) {
  Random random(5);
  compare_all(read_prescription(JsonSource::from_text(
                  R"({"format": 1, "name": "mirror", "image_z_mm": -100, "half_field_deg": 0.5, "elements": [
        {"name": "M1", "faces": [{"z_mm": 0, "radius_mm": -200, "conic": -1, "mirror": true, "clear_radius_mm": 60}]}],
        "stops": [{"name": "s", "aperture": true, "z_mm": 0, "opening_radius_mm": 50, "on_face": 1}]})",
                  "lens.json")),
              random);
}

}  // namespace
}  // namespace relign::optics
