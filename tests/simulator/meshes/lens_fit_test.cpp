// Meshes of a prescription's elements are closed, and fits recover the prescription.
#include "meshes/lens_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_text.h"
#include "meshes/mesh_check.h"
#include "meshes/mesh_writer.h"
#include "meshes/smooth.h"
#include "optics/lens_under_test.h"

namespace relign::meshes {
namespace {

using optics::relign_od;
using testing::HasSubstr;

optics::Element element(double front_radius, double front_clear, double back_radius, double back_clear,
                        double thickness) {
  const auto face = [](double z, double radius, double clear) {
    optics::Face made;
    made.z_mm = z;
    made.curvature = radius == 0 ? 0 : 1 / radius;
    made.clear_radius_mm = clear;
    return made;
  };
  return {"E", {face(3, front_radius, front_clear), face(3 + thickness, back_radius, back_clear)}};
}

// Plane, concave and convex faces, either one larger; the last two have edges that a cone would cut.
const std::vector<optics::Element>& shapes() {
  static const std::vector<optics::Element> kShapes = {element(0, 2, 0, 2, 1),        element(0, 2, -5, 1.5, 1),
                                                       element(5, 1, -5, 2, 2),       element(-5, 2, 5, 1, 1),
                                                       element(-3, 1, -3, 2.5, 1.5),  element(3, 1, 3.2, 2.9, 0.3),
                                                       element(-3.2, 2.9, -3, 1, 0.3)};
  return kShapes;
}

TEST(ElementMesh, IsClosedForEveryShape) {
  for (std::size_t i = 0; i < shapes().size(); ++i)
    for (const double pitch : {0.5, 0.13}) {
      const Mesh mesh = element_mesh(shapes()[i], pitch);
      EXPECT_NO_THROW(check_mesh(welded(mesh), Demand::body, "shape " + std::to_string(i)));
    }
  for (const optics::Element& made : relign_od().elements)
    for (const double pitch : {1.0, 0.2, 0.05})
      EXPECT_NO_THROW(check_mesh(element_mesh(made, pitch), Demand::body, made.name));
}

TEST(ElementMesh, HasTheRequestedPitch) {
  const Mesh mesh = element_mesh(relign_od().elements[2], 0.1);
  const Patches patches = smooth_patches(mesh);
  EXPECT_EQ(patches.count, 3u) << "front, edge, back";
  double longest = 0, sum = 0;
  int edges = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (patches.of_triangle[t] != patches.of_triangle[0]) continue;
    for (std::size_t i = 0; i < 3; ++i, ++edges) {
      const double edge = length(mesh.corner(t, (i + 1) % 3) - mesh.corner(t, i));
      longest = std::max(longest, edge);
      sum += edge;
    }
  }
  EXPECT_NEAR(sum / edges, 0.105, 0.01);
  EXPECT_LT(longest, 0.16);
}

TEST(ElementMesh, RejectsUnsupportedElements) {
  optics::Element cemented = shapes()[0];
  cemented.faces.push_back(cemented.faces[1]);
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { element_mesh(cemented, 0.1); }), HasSubstr("E has 3 faces"));
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { element_mesh(shapes()[0], 1e-5); }),
              HasSubstr("gives too many triangles"));
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { element_mesh(element(3, 2.5, -3, 2.5, 0.5), 0.1); }),
              HasSubstr("no edge"));
}

TEST(LensFit, RecoversThePrescription) {
  for (const optics::Element& made : relign_od().elements) {
    const FittedElement fitted = fit_element(element_mesh(made, 0.1), made.name);
    for (const auto& [face, found] : {std::pair{made.faces[0], fitted.front}, {made.faces[1], fitted.back}}) {
      EXPECT_NEAR(found.z_mm, face.z_mm, 1e-9) << made.name;
      EXPECT_NEAR(1 / found.curvature, 1 / face.curvature, 1e-7) << made.name;
      EXPECT_NEAR(found.clear_radius_mm, face.clear_radius_mm, 1e-9);
      EXPECT_NEAR(found.tilt_deg[0], 0, 1e-8);
      EXPECT_LT(found.residual_largest_mm, 1e-9);
      EXPECT_LE(found.residual_rms_mm, found.residual_largest_mm);
    }
  }
}

TEST(LensFit, FitsPlanesAndSteepFaces) {
  const FittedElement flat = fit_element(element_mesh(shapes()[1], 0.1), "E");
  EXPECT_NEAR(flat.front.curvature, 0, 1e-9);
  EXPECT_NEAR(1 / flat.back.curvature, -5, 1e-7);
  const FittedElement steep = fit_element(element_mesh(shapes()[5], 0.05), "E");
  EXPECT_NEAR(1 / steep.back.curvature, 3.2, 1e-7);
}

// A face surrounded by a flat rim, at only 3 degrees to it, as design programs make elements.
TEST(LensFit, IgnoresFlatRims) {
  Mesh mesh = element_mesh(element(40, 3, -20, 3, 1), 0.2);
  double rim = 0;  // the ring next to 2 mm
  for (const Vec3& v : mesh.vertices)
    if (v.z < 3.2 && std::hypot(v.x, v.y) < 2.01) rim = std::max(rim, std::hypot(v.x, v.y));
  const double rim_z = 3 + 40 - std::sqrt(40.0 * 40 - rim * rim);
  for (Vec3& v : mesh.vertices)
    if (v.z < 3.2 && std::hypot(v.x, v.y) > rim) v.z = rim_z;
  const FittedFace front = fit_element(mesh, "rim").front;
  EXPECT_NEAR(front.clear_radius_mm, rim, 1e-9);
  EXPECT_NEAR(1 / front.curvature, 40, 1e-5);
  EXPECT_LT(front.residual_largest_mm, 1e-8);
}

TEST(LensFit, ReportsTiltAndResiduals) {
  Mesh mesh = element_mesh(relign_od().elements[3], 0.1);
  const Mesh straight = mesh;
  const optics::Motion tilt{optics::rotation_of_degrees(0.5, 0, 0), {0, 0, 0}};
  for (Vec3& v : mesh.vertices) v = tilt.point(v);
  const FittedFace front = fit_element(mesh, "tilted").front;
  // The centre of the sphere is 15.07 + 5.13 mm from the pivot, so that the axis crosses it slightly off the vertex.
  EXPECT_NEAR(1 / front.curvature, 5.12683, 1e-7);
  EXPECT_NEAR(front.tilt_deg[1], -std::asin(20.201453 * std::sin(0.5 * 0.0174532925) / 5.12683) * 57.29578, 1e-4);

  mesh = straight;
  for (Vec3& v : mesh.vertices) v.z += 1e-4 * (v.x * v.x - v.y * v.y);
  const FittedFace bent = fit_element(mesh, "bent").front;
  EXPECT_GT(bent.residual_largest_mm, 4e-4);
  EXPECT_LT(bent.residual_largest_mm, 1.2e-3);
  EXPECT_GT(bent.residual_rms_mm, 1e-4);
}

TEST(LensFit, RejectsMeshesThatAreNotElements) {
  Mesh aside = element_mesh(shapes()[0], 0.5);
  for (Vec3& v : aside.vertices) v.x += 10;
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { fit_element(aside, "L1.ply"); }),
              HasSubstr("L1.ply: the z axis (x = y = 0) misses the mesh"));
  Mesh cube;
  cube.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
  cube.triangles = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                    {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { fit_element(cube, "L1.ply"); }),
              HasSubstr("has 4 corners; a sphere needs 8"));
}

TEST(SmoothNormals, AreExactOnSpheresAndSharpAtEdges) {
  const optics::Element& made = relign_od().elements[3];
  const Mesh mesh = element_mesh(made, 0.2);
  const CornerNormals normals = corner_normals(mesh);
  const Patches patches = smooth_patches(mesh);
  const double radius = 1 / made.faces[0].curvature, edge = made.faces[0].clear_radius_mm;
  double largest = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3& v = mesh.corner(t, i);
      if (patches.of_triangle[t] != patches.of_triangle[0]) continue;
      const Vec3 outwards = unit(v - Vec3{0, 0, made.faces[0].z_mm + radius});
      const double error = length(normals.normals[normals.corners[t][i]] - outwards);
      if (std::hypot(v.x, v.y) < edge - 1e-6)
        largest = std::max(largest, error);
      else
        EXPECT_LT(error, 0.1) << "at the rim, where only one side's faces count";
    }
  EXPECT_LT(largest, 1e-12);
}

}  // namespace
}  // namespace relign::meshes
