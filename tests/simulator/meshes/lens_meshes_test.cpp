// Rays through meshes converge to those through spheres with finer meshes.
#include "meshes/lens_meshes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_text.h"
#include "meshes/mesh_writer.h"
#include "optics/lens_under_test.h"
#include "optics/trace.h"

namespace relign::meshes {
namespace {

using optics::relign_od;
using testing::HasSubstr;

std::map<std::string, Mesh> meshes_of(const optics::Prescription& lens, double pitch) {
  std::map<std::string, Mesh> meshes;
  for (const optics::Element& element : lens.elements) meshes[element.name] = element_mesh(element, pitch);
  return meshes;
}

struct Landing {
  double rms_um = 0, largest_um = 0;
  int rays = 0, lost = 0;
};

// Rays of distant object points over field and pupil, traced by both, compared on the image plane.
Landing compare(const LensMeshes& meshes, const optics::Assembly& assembly) {
  const optics::Prescription& lens = assembly.lens();
  Landing landing;
  for (const double field : {0.0, 12.0, 25.0, 36.0})
    for (int k = 0; k < 400; ++k) {
      // A spiral over the entrance pupil: uniform, and not aligned with any mesh.
      const double radius = 0.68 * std::sqrt((k + 0.5) / 400), angle = 2.399963229728653 * k;
      optics::Ray ray = optics::chief_ray(lens, field);
      ray.start = ray.start + Vec3{radius * std::cos(angle), radius * std::sin(angle), 0};
      const optics::TracedRay exact = optics::trace(assembly, ray, optics::Apertures::mesh);
      const LensMeshes::Passed found = meshes.trace_ray(ray.start, unit(ray.direction), false);
      if (!exact.passed && !found.passed) continue;
      if (exact.passed != found.passed) {
        ++landing.lost;
        continue;
      }
      EXPECT_EQ(found.faces, 8);
      const Vec3 at = found.at + ((lens.image_z_mm - found.at.z) / found.direction.z) * found.direction;
      const double error = 1000 * length(at - exact.image);
      landing.rms_um += error * error;
      landing.largest_um = std::max(landing.largest_um, error);
      ++landing.rays;
    }
  landing.rms_um = std::sqrt(landing.rms_um / landing.rays);
  return landing;
}

TEST(LensMeshes, ConvergeWithTheSquareOfThePitch) {
  const optics::Prescription& lens = relign_od();
  optics::Assembly perfect(lens);
  double before = 0;
  for (const double pitch : {0.2, 0.1, 0.05}) {
    const Landing landing = compare(LensMeshes(lens, meshes_of(lens, pitch)), perfect);
    ASSERT_GT(landing.rays, 1400);
    EXPECT_LE(landing.lost, 3) << "only at the rim of the stop";
    EXPECT_LT(landing.rms_um, 1.5 * 1.25 * std::pow(pitch / 0.2, 2));
    if (before > 0) {
      EXPECT_NEAR(before / landing.rms_um, 4, 0.8);
    }
    before = landing.rms_um;
  }
}

TEST(LensMeshes, ElementsMoveAsRigidBodies) {
  const optics::Prescription& lens = relign_od();
  std::map<std::string, optics::ElementOffset> offsets;
  offsets["L3"].tilt_deg = {0.7, -0.4};
  offsets["L4"].shift_mm = {0.01, -0.02, 0.03};
  offsets["L4"].tilt_deg = {-0.5, 0.2};
  const optics::Assembly built(lens, offsets), perfect(lens);
  LensMeshes meshes(lens, meshes_of(lens, 0.1));
  meshes.place(built, {}, {});
  EXPECT_LT(compare(meshes, built).rms_um, 0.6);
  EXPECT_GT(compare(meshes, perfect).rms_um, 20) << "the perfect lens is another one";
}

TEST(LensMeshes, FresnelMatchesPrescription) {
  const optics::Prescription& lens = relign_od();
  const LensMeshes meshes(lens, meshes_of(lens, 0.1));
  double expected = 1;
  for (const optics::Element& element : lens.elements) {
    const double n = element.faces[0].index_after;
    expected *= std::pow(4 * n / (n + 1) / (n + 1), 2);
  }
  const LensMeshes::Passed along = meshes.trace_ray({0.001, 0.002, -1}, {0, 0, 1}, true);
  ASSERT_TRUE(along.passed);
  EXPECT_NEAR(along.transmittance, expected, 1e-4);
  const LensMeshes::Passed back = meshes.trace_ray({0.001, 0.002, 20}, {0, 0, -1}, true);
  ASSERT_TRUE(back.passed);
  EXPECT_NEAR(back.transmittance, expected, 1e-4);
  EXPECT_EQ(meshes.trace_ray({0.001, 0.002, -1}, {0, 0, 1}, false).transmittance, 1);
}

TEST(LensMeshes, StopsAndBarrelAbsorb) {
  const optics::Prescription& lens = relign_od();
  const LensMeshes meshes(lens, meshes_of(lens, 0.3));
  EXPECT_FALSE(meshes.trace_ray({1.5, 0, 10.4}, {0, 0, -1}, false).passed) << "beside the aperture stop's opening";
  EXPECT_TRUE(meshes.trace_ray({1.3, 0, 10.4}, {0, 0, -1}, false).passed);
  EXPECT_FALSE(meshes.trace_ray({4.8, 0, 20}, unit(Vec3{0.5, 0, -1}), false).passed) << "into the bore";
  EXPECT_FALSE(meshes.trace_ray({5, 0, 21}, {0, 0, -1}, false).passed) << "onto the rear rim";

  // The same stop as a mesh: a plate with a square opening of 1 x 1 mm.
  Mesh plate;
  const double z = 10.3;
  plate.vertices = {{-5, -5, z},     {5, -5, z},     {5, 5, z},     {-5, 5, z},
                    {-0.5, -0.5, z}, {0.5, -0.5, z}, {0.5, 0.5, z}, {-0.5, 0.5, z}};
  plate.triangles = {{0, 1, 5}, {0, 5, 4}, {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
  auto with_plate = meshes_of(lens, 0.3);
  with_plate["aperture stop"] = plate;
  const LensMeshes closed(lens, with_plate);
  EXPECT_TRUE(closed.trace_ray({0.4, 0.4, 10.4}, {0, 0, -1}, false).passed);
  EXPECT_FALSE(closed.trace_ray({0.6, 0, 10.4}, {0, 0, -1}, false).passed);
}

TEST(LensMeshes, RejectsUnknownNames) {
  const optics::Prescription& lens = relign_od();
  auto meshes = meshes_of(lens, 0.5);
  meshes["apertur stop"] = meshes["L1"];
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { LensMeshes(lens, meshes); }),
              HasSubstr("did you mean 'aperture stop'?"));
  meshes.erase("apertur stop");
  meshes.erase("L2");
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { LensMeshes(lens, meshes); }),
              HasSubstr("missing mesh of element 'L2'"));
}

}  // namespace
}  // namespace relign::meshes
