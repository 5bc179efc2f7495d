// Absolute irradiance of images: a uniform emitter gives the integral of the transmittance over the passing directions,
// computed here with single rays in double, without tiles, regions and samplers.
#include <gtest/gtest.h>

#include <cmath>

#include "exact_rays.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

using optics::Apertures;

// The paper's lens in front of a white emitter so large that its border is outside the image.
const SceneFile& flat_field() {
  static const SceneFile scene = [] {
    SceneFile flat = relign_od_scene();
    flat.emitter.side_mm *= 4;
    flat.emitter.show(images::Image(2, 2, 1.0F));
    return flat;
  }();
  return scene;
}

const optics::Assembly& lens_from_behind() {
  static const optics::Prescription turned = turned_round(relign_od_scene());
  static const optics::Assembly lens(turned);
  return lens;
}

images::Image flat_image(Transport transport) {
  Parallel parallel(2);
  CaptureSettings settings;
  settings.transport = transport;
  Camera camera(flat_field(), settings, parallel);
  MountedLens lens(flat_field());
  const Sensor& sensor = flat_field().sensor;
  images::Image image(static_cast<std::size_t>(sensor.width), static_cast<std::size_t>(sensor.height));
  camera.render_noise_free(lens, nominal_pose(), 5, 2048, image.values.data());
  return image;
}

// Distance of a pixel's centre from the axis.
double radius_mm(std::size_t x, std::size_t y) {
  const optics::Vec3 middle = flat_field().sensor.place(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
  return std::hypot(middle.x, middle.y);
}

// The exact irradiance as a table, finer where apertures begin to cut.
class Profile {
 public:
  explicit Profile(bool fresnel) {
    for (double radius = 0; radius < 1.95; radius += radius < 1.7 ? 0.02 : 0.004) {
      radii_.push_back(radius);
      values_.push_back(exact_irradiance(lens_from_behind(), radius, Apertures::mesh, fresnel));
    }
  }
  double at(double radius) const {
    std::size_t k = 1;
    while (radii_[k] < radius) ++k;
    const double share = (radius - radii_[k - 1]) / (radii_[k] - radii_[k - 1]);
    return (1 - share) * values_[k - 1] + share * values_[k];
  }

 private:
  std::vector<double> radii_, values_;
};

struct Part {
  double image = 0, exact = 0;
  int pixels = 0;
  double deviation() const { return image / exact - 1; }
};

// The flat field rendered by the camera, and the expected one.
struct FlatField {
  explicit FlatField(Transport transport) : image(flat_image(transport)), exact(transport == Transport::fresnel) {}
  images::Image image;
  Profile exact;
};

const FlatField& seen_with(Transport transport) {
  static const FlatField refract(Transport::refract), fresnel(Transport::fresnel);
  return transport == Transport::fresnel ? fresnel : refract;
}

void report(const char* name, double share) {
  std::printf("%s: %.3f %%\n", name, 100 * share);
  testing::Test::RecordProperty(name, std::to_string(share));
}

TEST(Radiometry, RaysAreReversible) {
  const optics::Assembly lens(relign_od_scene().lens);
  const optics::Ray ray{{-3, 20, -50}, {3.1, -20.1, 55.82}};
  const optics::TracedRay there = optics::trace(lens, ray, Apertures::mesh);
  ASSERT_TRUE(there.passed) << there.lost_at;
  const optics::Vec3 d = there.exit_direction;
  const optics::TracedRay back =
      optics::trace(lens_from_behind(), {{there.image.x, there.image.y, 0}, {-d.x, -d.y, d.z}}, Apertures::mesh);
  ASSERT_TRUE(back.passed) << back.lost_at;
  const double way = (-50 - (flat_field().emitter.z_mm + flat_field().pivot_behind_first_vertex_mm));
  const optics::Vec3 start = back.image - (way / back.exit_direction.z) * back.exit_direction;
  EXPECT_NEAR(start.x, -3, 1e-9);
  EXPECT_NEAR(start.y, 20, 1e-9);
  const optics::Ray reversed{{there.image.x, there.image.y, 0}, {-d.x, -d.y, d.z}};
  EXPECT_NEAR(transmittance(lens, ray, there), transmittance(lens_from_behind(), reversed, back), 1e-12);
}

TEST(Radiometry, MatchesPiSineSquaredOnTheAxis) {
  // Without transmittance the integral has a closed form: the marginal ray's.
  double low = 0, high = 0.5;
  for (int step = 0; step < 40; ++step) {
    const double sine = (low + high) / 2;
    const optics::Ray ray{{0, 0, 0}, {0, sine, std::sqrt(1 - sine * sine)}};
    (optics::trace(lens_from_behind(), ray, Apertures::mesh).passed ? low : high) = sine;
  }
  EXPECT_NEAR(exact_irradiance(lens_from_behind(), 0, Apertures::mesh, false), kPi * low * low, 1e-7);
}

class RadiometryOf : public testing::TestWithParam<Transport> {};
INSTANTIATE_TEST_SUITE_P(Transports, RadiometryOf, testing::Values(Transport::refract, Transport::fresnel),
                         [](const auto& one) { return one.param == Transport::fresnel ? "fresnel" : "refract"; });

TEST_P(RadiometryOf, UniformEmitterMatchesIntegralOfTransmittance) {
  const auto& [image, exact] = seen_with(GetParam());
  // Fields of 6 x 6 pixels on the axis, in the field, and towards a corner.
  double largest = 0;
  for (const auto& [left, top] :
       {std::pair<std::size_t, std::size_t>{97, 97}, {127, 97}, {97, 150}, {60, 62}, {140, 57}}) {
    Part part;
    for (std::size_t y = top; y < top + 6; ++y)
      for (std::size_t x = left; x < left + 6; ++x) {
        part.image += static_cast<double>(image.at(x, y));
        part.exact += exact.at(radius_mm(x, y));
      }
    EXPECT_LT(std::fabs(part.deviation()), 0.002) << "pixels from " << left << ", " << top;
    largest = std::max(largest, std::fabs(part.deviation()));
  }
  report("uniform_emitter_largest_deviation", largest);
}

TEST_P(RadiometryOf, FlatFieldMatchesRelativeIllumination) {
  const auto& [image, exact] = seen_with(GetParam());
  // Rings one pixel wide, out to the corner of the paper's emitter.
  const double pitch = flat_field().sensor.pitch_mm;
  std::vector<Part> rings(static_cast<std::size_t>(1.9 / pitch));
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) {
      const auto ring = static_cast<std::size_t>(radius_mm(x, y) / pitch);
      if (ring >= rings.size()) continue;
      rings[ring].image += static_cast<double>(image.at(x, y));
      rings[ring].exact += exact.at(radius_mm(x, y));
      ++rings[ring].pixels;
    }
  double largest = 0, largest_step = 0;
  for (std::size_t ring = 0; ring < rings.size(); ++ring) {
    EXPECT_LT(std::fabs(rings[ring].deviation()), 0.005)
        << "ring " << ring << " of " << rings[ring].pixels << " pixels";
    largest = std::max(largest, std::fabs(rings[ring].deviation()));
    if (ring < 3) continue;  // rings of some pixels are noise
    const double step = std::fabs(rings[ring].deviation() - rings[ring - 1].deviation());
    EXPECT_LT(step, 0.002) << "between rings " << ring - 1 << " and " << ring;
    largest_step = std::max(largest_step, step);
  }
  report("flat_field_largest_deviation", largest);
  report("flat_field_largest_step", largest_step);
  EXPECT_GT(rings.back().exact / rings.back().pixels / exact.at(0), 0.9) << "the profile reaches to the image's border";
}

TEST(Radiometry, ListingAperturesMatchPublishedRelativeIllumination) {
  const auto relative = [](double radius) {
    return exact_irradiance(lens_from_behind(), radius, Apertures::listing, false) /
           exact_irradiance(lens_from_behind(), 0, Apertures::listing, false);
  };
  for (double radius = 0; radius < 1.881; radius += 0.04) EXPECT_GE(relative(radius), 0.60) << radius;
  EXPECT_GE(relative(1.88), 0.60);
  EXPECT_NEAR(relative(1.9015), 0.566, 0.01);
  report("listing_at_1.88_mm", relative(1.88));
  report("listing_at_1.9015_mm", relative(1.9015));
}

}  // namespace
}  // namespace relign::imaging
