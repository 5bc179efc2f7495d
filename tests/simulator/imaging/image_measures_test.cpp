// Measures of images of the lens, against single rays.
#include <gtest/gtest.h>

#include <cmath>

#include "exact_rays.h"
#include "images/measures.h"
#include "images/registration.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

SceneFile scene_showing(const std::string& target) {
  SceneChoices choices;
  choices.target = target;
  return relign_od_scene_with(choices);
}

images::Image image_of(const SceneFile& scene, const std::vector<double>& pose, bool noise_free = true) {
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  images::Image image(static_cast<std::size_t>(scene.sensor.width), static_cast<std::size_t>(scene.sensor.height));
  if (noise_free)
    camera.render_noise_free(lens, pose, 6, 1024, image.values.data());
  else
    camera.capture(lens, pose, 6, image.values.data());
  return image;
}

double sinc(double x) { return x == 0 ? 1.0 : std::sin(kPi * x) / (kPi * x); }

// One square of half the emitter's side; of its edges, the one that the image shows on the left.
constexpr double kAngle_deg = 5;
SceneFile one_square() { return scene_showing("slanted_edges:squares=1,angle_deg=" + std::to_string(kAngle_deg)); }

// `along_mm` from the middle of that edge.
optics::Vec3 place_on_edge(const SceneFile& scene, double along_mm) {
  const optics::SineCosine turn = optics::sine_cosine_of_degrees(kAngle_deg);
  const double half = scene.emitter.side_mm / 4;
  return {turn.cosine * half - turn.sine * along_mm, turn.sine * half + turn.cosine * along_mm, scene.emitter.z_mm};
}

// Modulation by the rays from a point of the emitter along (across_x, across_y).
double modulation_of_rays(const SceneFile& scene, const std::vector<double>& pose, const optics::Vec3& from,
                          double across_x, double across_y, double cycles_per_pixel) {
  const optics::Assembly lens(scene.lens);
  double sum = 0, real = 0, imaginary = 0;
  for_bundle(scene, lens, pose, from, [&](const optics::Vec3& hit, double light) {
    const PixelPlace place = pixel_of(scene.sensor, hit);
    const double phase = 2 * kPi * cycles_per_pixel * (across_x * place.x + across_y * place.y);
    sum += light;
    real += light * std::cos(phase);
    imaginary += light * std::sin(phase);
  });
  return std::hypot(real, imaginary) / sum;
}

// And the square pixel.
double modulation_of_pixel(double across_x, double across_y, double cycles_per_pixel) {
  return sinc(cycles_per_pixel * across_x) * sinc(cycles_per_pixel * across_y);
}

// Across the edge, and of the drawing: texels are grey by area and looked up bilinearly, as if three of them stood
// behind each other.
double exact_edge_mtf(const SceneFile& scene, const std::vector<double>& pose, double cycles_per_pixel) {
  const optics::Assembly lens(scene.lens);
  const PixelPlace one = bundle_centroid(scene, lens, pose, place_on_edge(scene, -2));
  const PixelPlace other = bundle_centroid(scene, lens, pose, place_on_edge(scene, 2));
  const double length = std::hypot(other.x - one.x, other.y - one.y);
  const double texel_px = length / 4 * scene.emitter.side_mm / static_cast<double>(scene.emitter.radiance.width);
  const double across_x = (other.y - one.y) / length, across_y = (one.x - other.x) / length;
  return std::pow(sinc(cycles_per_pixel * texel_px), 3) * modulation_of_pixel(across_x, across_y, cycles_per_pixel) *
         modulation_of_rays(scene, pose, place_on_edge(scene, 0), across_x, across_y, cycles_per_pixel);
}

TEST(ImageMeasures, SlantedEdgeMtfMatchesRaysAndPixel) {
  const SceneFile scene = one_square();
  const optics::Assembly lens(scene.lens);
  double largest = 0;
  for (const double z : {0.5, 0.52, 0.46}) {
    const std::vector<double> pose = {0.5, 0.5, z, 0.5, 0.5};
    const PixelPlace middle = bundle_centroid(scene, lens, pose, place_on_edge(scene, 0));
    // So few rows that the lens's distortion does not bend the edge.
    const images::Region region{static_cast<std::size_t>(middle.x) - 13, static_cast<std::size_t>(middle.y) - 10, 27,
                                21};
    const images::Image image = image_of(scene, pose);
    for (const double f : {0.05, 0.1, 0.2, 0.3, 0.4}) {
      const double exact = exact_edge_mtf(scene, pose, f), found = images::edge_mtf(image, region, f);
      std::printf("z %.2f, %.2f cycles/px: rays %.4f, image %.4f\n", z, f, exact, found);
      EXPECT_NEAR(found, exact, 0.02) << "z " << z << ", " << f << " cycles per pixel";
      largest = std::max(largest, std::fabs(found - exact));
    }
  }
  std::printf("largest deviation %.4f\n", largest);
}

TEST(ImageMeasures, StarContrastMatchesRaysAndPixel) {
  const SceneFile& scene = relign_od_scene();
  double largest = 0;
  for (const double z : {0.5, 0.52, 0.46}) {
    const std::vector<double> pose = {0.5, 0.5, z, 0.5, 0.5};
    const images::Image image = image_of(scene, pose);
    const PixelPlace near_axis =
        bundle_centroid(scene, optics::Assembly(scene.lens), pose, {10, 0, scene.emitter.z_mm});
    const double px_per_mm = std::fabs(near_axis.x - 99.5) / 10;
    for (const double radius : {9.0, 14.0, 20.0, 30.0}) {
      const int cycles = 18;
      const double f = cycles / (2 * kPi * radius);
      // A black and white star's fundamental is 4 / pi. The wave runs round: rays are the same everywhere on the
      // circle, the pixel's share is not.
      const double emitter_mm = radius / px_per_mm;
      double exact = 4 / kPi * modulation_of_rays(scene, pose, {emitter_mm, 0, scene.emitter.z_mm}, 0, 1, f);
      double pixel = 0;
      constexpr int kDirections = 72;
      for (int direction = 0; direction < kDirections; ++direction) {
        const optics::SineCosine angle = optics::sine_cosine_of_degrees(360.0 * direction / kDirections);
        pixel += modulation_of_pixel(angle.cosine, angle.sine, f) / kDirections;
      }
      exact *= pixel;
      const double found = images::star_contrast(image, {99.5, 99.5, radius, cycles});
      std::printf("z %.2f, radius %.0f px (%.3f cycles/px): rays %.4f, image %.4f\n", z, radius, f, exact, found);
      EXPECT_NEAR(found, exact, 0.02) << "z " << z << ", radius " << radius;
      largest = std::max(largest, std::fabs(found - exact));
    }
  }
  std::printf("largest deviation %.4f\n", largest);
}

TEST(ImageMeasures, ShiftMatchesRaysAtThePapersNoise) {
  const SceneFile& scene = relign_od_scene();
  const optics::Assembly lens(scene.lens);
  const images::Image reference = image_of(scene, nominal_pose());
  const optics::Vec3 middle{0, 0, scene.emitter.z_mm};
  const PixelPlace at_rest = bundle_centroid(scene, lens, nominal_pose(), middle);
  for (const bool noise_free : {true, false}) {
    double largest = 0;
    for (const auto& [x, y] : {std::pair{0.51, 0.48}, std::pair{0.62, 0.55}, std::pair{0.3, 0.25}}) {
      const std::vector<double> pose = {x, y, 0.5, 0.5, 0.5};
      const PixelPlace exact = bundle_centroid(scene, lens, pose, middle);
      const images::Registration found = images::registration(image_of(scene, pose, noise_free), reference);
      const double within = noise_free ? 0.1 : 0.2;
      EXPECT_NEAR(found.shift_x_px, exact.x - at_rest.x, within) << x << ", " << y;
      EXPECT_NEAR(found.shift_y_px, exact.y - at_rest.y, within) << x << ", " << y;
      EXPECT_NEAR(found.rotation_deg, 0, noise_free ? 0.05 : 0.3) << x << ", " << y;
      largest =
          std::max(largest, std::hypot(found.shift_x_px - exact.x + at_rest.x, found.shift_y_px - exact.y + at_rest.y));
    }
    std::printf("%s: largest deviation %.3f px\n", noise_free ? "noise-free" : "the paper's noise", largest);
  }
}

TEST(ImageMeasures, RotationOfTheTargetIsMirrored) {
  const auto white_square = [](int angle_deg) {
    SceneFile scene = scene_showing("slanted_edges:squares=1,angle_deg=" + std::to_string(angle_deg));
    images::Image negative = scene.emitter.radiance;
    for (float& value : negative.values) value = 1 - value;
    scene.emitter.show(negative);
    return image_of(scene, nominal_pose());
  };
  const images::Registration found = images::registration(white_square(8), white_square(5));
  EXPECT_NEAR(found.rotation_deg, -3, 0.1) << "columns run against the emitter's x, rows with its y";
  EXPECT_NEAR(found.shift_x_px, 0, 0.02);
  EXPECT_NEAR(found.shift_y_px, 0, 0.02);
}

}  // namespace
}  // namespace relign::imaging
