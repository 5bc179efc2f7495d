// Each imaging error against its law.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "imaging/capture_errors.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

using testing::HasSubstr;

constexpr int kSide = 100;
constexpr float kWhite = 0.2F;
using Pixels = std::vector<float>;

Sensor square_sensor(double file_pixels = 1) {
  Sensor sensor;
  sensor.width = sensor.height = kSide;
  sensor.pitch_mm = 0.01;
  sensor.file_pitch_mm = 0.01 * file_pixels;
  return sensor;
}

CaptureErrors errors_of(const std::string& json, double file_pixels = 1) {
  return {read_imaging_errors(JsonSource::from_text(json, "errors.json")), square_sensor(file_pixels),
          static_cast<double>(kWhite), 100};
}

Pixels altered(CaptureErrors& errors, Pixels pixels, std::uint64_t seed) {
  if (errors.draw(seed)) errors.apply(pixels.data());
  return pixels;
}

Pixels altered(const std::string& json, float value, std::uint64_t seed = 1) {
  CaptureErrors errors = errors_of(json);
  return altered(errors, Pixels(kSide * kSide, value), seed);
}

struct Moments {
  double mean = 0, variance = 0;
};

Moments moments_of(const Pixels& values) {
  Moments found;
  for (const float value : values) found.mean += static_cast<double>(value) / static_cast<double>(values.size());
  for (const float value : values)
    found.variance += std::pow(static_cast<double>(value) - found.mean, 2) / static_cast<double>(values.size() - 1);
  return found;
}

// Five standard errors of mean and variance of `count` draws, for a law with this variance and fourth central moment.
void expect_moments(const Pixels& values, double mean, double variance, double fourth) {
  const auto [found_mean, found_variance] = moments_of(values);
  const auto count = static_cast<double>(values.size());
  EXPECT_NEAR(found_mean, mean, 5 * std::sqrt(variance / count));
  EXPECT_NEAR(found_variance, variance, 5 * std::sqrt((fourth - variance * variance) / count));
}

TEST(ImagingErrors, PhotonNoiseHasMeanAndVarianceOfPoisson) {
  constexpr double kQuantum = 0.25;  // of white
  const double quantum = kQuantum * static_cast<double>(kWhite);
  for (const double mean : {0.02, 0.3, 3.0, 11.5, 12.5, 80.0}) {
    Pixels counts = altered(R"({"photon": 0.25})", static_cast<float>(mean * quantum));
    for (float& value : counts) {
      value = static_cast<float>(static_cast<double>(value) / quantum);
      ASSERT_NEAR(value, std::round(value), 1e-4) << "a multiple of the quantum";
    }
    SCOPED_TRACE(mean);
    expect_moments(counts, mean, mean, mean + 3 * mean * mean);
  }
  EXPECT_EQ(altered(R"({"photon": 0.25})", 0), Pixels(kSide * kSide, 0));
  // More photons than an integer of 32 bits counts.
  for (const float value : altered(R"({"photon": 1e-11})", kWhite)) ASSERT_NEAR(value, kWhite, 1e-4F * kWhite);
}

TEST(ImagingErrors, SmallCountsFollowPoisson) {
  const Pixels values = altered(R"({"photon": 1})", 2 * kWhite);
  double probability = std::exp(-2.0);
  for (int k = 0; k < 6; ++k) {
    const auto share = static_cast<double>(std::count_if(values.begin(), values.end(),
                                                         [&](float v) { return std::lround(v / kWhite) == k; })) /
                       static_cast<double>(values.size());
    EXPECT_NEAR(share, probability, 5 * std::sqrt(probability / static_cast<double>(values.size()))) << k;
    probability *= 2.0 / (k + 1);
  }
}

// A loop over pixels does more steps than a pixel of its own needs, and GPU kernels fewer: no word counts on in them.
TEST(ImagingErrors, PhotonLoopsEndAboveEveryWord) {
  for (int i = 0; i <= 100'000; ++i) {
    const float mean = kFewPhotons * static_cast<float>(i) / 100'000;
    PoissonSum sum = no_photons(mean);
    for (int k = 1; k <= photon_steps(mean); ++k) add_count(sum, mean, 1 / static_cast<float>(k));
    ASSERT_GT(sum.below, poisson_word(0xFFFFFFFFU)) << mean;
  }
}

TEST(ImagingErrors, NoiseAndPatternsHaveTheGivenDeviation) {
  const double white = static_cast<double>(kWhite);
  const auto normal = [&](const char* json, double mean, double sigma) {
    SCOPED_TRACE(json);
    expect_moments(altered(json, kWhite), mean, sigma * sigma, 3 * std::pow(sigma, 4));
  };
  normal(R"({"read_noise": 0.05})", white, 0.05 * white);
  normal(R"({"pixel_gain": 0.02})", white, 0.02 * white);
  normal(R"({"pixel_offset": 0.01})", white, 0.01 * white);
  normal(R"({"pixel_gain": 0.02, "gain": 2, "offset": 0.1})", 2.1 * white, 0.04 * white);
}

TEST(ImagingErrors, GainGammaAndOffsetAreExact) {
  for (const float value : {1e-4F, 0.01F, 0.2F, 1.0F}) {
    const double share = static_cast<double>(value / kWhite);
    for (const float found : altered(R"({"gain": 1.1, "gamma": 0.9, "offset": 0.02})", value)) {
      const double expected = static_cast<double>(kWhite) * (std::pow(1.1 * share, 0.9) + 0.02);
      ASSERT_NEAR(found, expected, 2e-6 * expected);
    }
  }
  for (const float found : altered(R"({"gamma": 0.9})", -0.1F)) ASSERT_EQ(found, -0.1F) << "values below 0 stay";
}

// Mean and variance of the derivative of an edge that was blurred.
void expect_blurred_edge(const std::string& json, double file_pixels, double sigma) {
  CaptureErrors errors = errors_of(json, file_pixels);
  for (const bool across : {true, false}) {
    Pixels edge(kSide * kSide, 0);
    for (int i = 0; i < kSide * kSide; ++i)
      if ((across ? i % kSide : i / kSide) >= kSide / 2) edge[static_cast<std::size_t>(i)] = 1;
    edge = altered(errors, edge, 1);
    const auto at = [&](int k) {
      return static_cast<double>(edge[static_cast<std::size_t>(across ? 30 * kSide + k : k * kSide + 30)]);
    };
    double sum = 0, mean = 0, square = 0;
    for (int k = 1; k < kSide; ++k) {
      const double rise = at(k) - at(k - 1), place = k - kSide / 2;
      sum += rise, mean += rise * place, square += rise * place * place;
    }
    EXPECT_NEAR(sum, 1, 1e-5);
    EXPECT_NEAR(mean, 0, 1e-4);
    EXPECT_NEAR(std::sqrt(square), sigma, 0.01 * sigma) << json;
  }
}

TEST(ImagingErrors, BlurHasTheGivenDeviation) {
  for (const double sigma : {0.3, 0.7, 2.5})
    expect_blurred_edge("{\"blur_px\": " + std::to_string(sigma) + "}", 1, sigma);
  expect_blurred_edge(R"({"blur_px": 0.8})", 0.5, 0.4);
}

TEST(ImagingErrors, QuantisesAndClips) {
  CaptureErrors errors = errors_of(R"({"bits": 3, "full_scale": 2})");
  Pixels ramp(kSide * kSide);
  for (std::size_t i = 0; i < ramp.size(); ++i) ramp[i] = -0.1F + 0.6F * static_cast<float>(i) / ramp.size();
  const Pixels found = altered(errors, ramp, 1);
  const float full = 2 * kWhite, step = full / 7;
  for (std::size_t i = 0; i < ramp.size(); ++i) {
    const float expected = std::clamp(ramp[i], 0.0F, full);
    ASSERT_NEAR(found[i], expected, 0.5F * step + 1e-6F);
    ASSERT_NEAR(found[i] / step, std::round(found[i] / step), 1e-5);
  }
  EXPECT_EQ(std::set<float>(found.begin(), found.end()).size(), 8U);
}

TEST(ImagingErrors, HotPixelsAreThoseOfTheStation) {
  CaptureErrors errors = errors_of(R"({"hot_pixels": 0.01, "full_scale": 3, "photon": 0.1})");
  std::vector<std::set<std::size_t>> hot(2);
  for (std::size_t frame = 0; frame < 2; ++frame) {
    const Pixels found = altered(errors, Pixels(kSide * kSide, kWhite), frame);
    for (std::size_t i = 0; i < found.size(); ++i)
      if (found[i] == 3 * kWhite) hot[frame].insert(i);
  }
  EXPECT_EQ(hot[0], hot[1]);
  EXPECT_NEAR(static_cast<double>(hot[0].size()), 100, 3) << "few places are drawn twice";
}

TEST(ImagingErrors, VignettingIsQuadratic) {
  const Pixels found = altered(R"({"vignetting": 0.2})", 1);
  const double curvature = -2 * 0.2 / (2 * 50.0 * 50.0);
  for (int column = 1; column + 1 < kSide; ++column) {
    const std::size_t at = 40 * kSide + static_cast<std::size_t>(column);
    const double second =
        static_cast<double>(found[at - 1]) - 2 * static_cast<double>(found[at]) + static_cast<double>(found[at + 1]);
    ASSERT_NEAR(second, curvature, 3e-7);
  }
  const float brightest = *std::max_element(found.begin(), found.end());
  EXPECT_NEAR(brightest, 1, 1e-4);
}

TEST(ImagingErrors, StrayLightHasItsMean) {
  CaptureErrors errors = errors_of(R"({"drawn": "capture", "stray_light": {"mean": 0.05, "blobs": [0, 3],
      "gradient": [0, 1], "rings": [0, 2], "arcs": [0, 2], "ring_share": 0.3}})");
  double unevenness = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const Pixels found = altered(errors, Pixels(kSide * kSide, 0), seed);
    const auto [mean, variance] = moments_of(found);
    ASSERT_NEAR(mean, 0.05 * static_cast<double>(kWhite), 1e-7);
    ASSERT_GE(*std::min_element(found.begin(), found.end()), 0);
    unevenness += std::sqrt(variance) / mean / 50;
  }
  EXPECT_GT(unevenness, 0.3);
}

TEST(ImagingErrors, AStationDiffersByPhotonAndReadNoiseOnly) {
  const std::string station =
      R"("stray_light": {"mean": [0.01, 0.05], "blobs": 2}, "blur_px": [0, 1], "gain": [0.9, 1.1],
      "pixel_gain": 0.02, "pixel_offset": 0.01, "target": {"scale": [0.9, 1.1]})";
  CaptureErrors errors = errors_of("{\"seed\": 5, " + station + "}"),
                other = errors_of("{\"seed\": 6, " + station + "}");
  const Pixels grey(kSide * kSide, 0.1F);
  const Pixels first = altered(errors, grey, 1);
  EXPECT_EQ(first, altered(errors, grey, 2));
  EXPECT_NE(first, altered(other, grey, 1));
  CaptureErrors anew = errors_of("{\"drawn\": \"capture\", " + station + "}");
  EXPECT_NE(altered(anew, grey, 1), altered(anew, grey, 2));
}

TEST(ImagingErrors, APureFunctionOfTheSeed) {
  const auto file = std::string(RELIGN_SOURCE_DIR) + "/python/relign_bench/training/randomisation.json";
  const auto make = [&] { return CaptureErrors(read_imaging_errors(file), square_sensor(), 0.2, 100); };
  CaptureErrors forwards = make(), backwards = make();
  const Pixels grey(kSide * kSide, 0.1F);
  std::vector<Pixels> found;
  for (std::uint64_t seed = 0; seed < 20; ++seed) found.push_back(altered(forwards, grey, seed));
  for (std::uint64_t seed = 20; seed-- > 0;) EXPECT_EQ(found[seed], altered(backwards, grey, seed));
  EXPECT_GT(std::set<Pixels>(found.begin(), found.end()).size(), 14U);
}

TEST(ImagingErrors, SharesOfCapturesAndOfErrors) {
  CaptureErrors some = errors_of(R"({"share": 0.7, "offset": 0.1})");
  CaptureErrors each = errors_of(R"({"drawn": "capture", "error_share": 0.4, "offset": 0.1, "gain": 2})");
  int untouched = 0, offset = 0, gain = 0, both = 0;
  const Pixels grey(kSide * kSide, kWhite);
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    untouched += some.draw(seed) ? 0 : 1;
    const double level = static_cast<double>(altered(each, grey, seed)[0] / kWhite);
    offset += std::fabs(level - 1.1) < 1e-3 || level > 2.05 ? 1 : 0;
    gain += level > 1.5 ? 1 : 0;
    both += level > 2.05 ? 1 : 0;
  }
  EXPECT_NEAR(untouched, 600, 100);
  EXPECT_NEAR(offset, 800, 110);
  EXPECT_NEAR(gain, 800, 110);
  EXPECT_NEAR(both, 320, 80);
}

TEST(ImagingErrors, AnEmptyFileAltersNothing) { EXPECT_EQ(altered("{}", 0.123F), Pixels(kSide * kSide, 0.123F)); }

// A print that is scaled about the axis gives the image of a scene whose emitter has that side.
TEST(ImagingErrors, PrintErrorsOfTheTargetAreRendered) {
  for (const Transport transport : {Transport::fresnel, Transport::ghost}) {
    SceneChoices choices;
    choices.pixels = 50;
    const SceneFile scene = relign_od_scene_with(choices);
    SceneFile larger = scene;
    larger.emitter.side_mm *= 1.05;
    Parallel parallel(1);
    const CaptureSettings settings{transport, Sampler::pupil, 16, 0.5};
    Camera camera(scene, settings, parallel), expected(larger, settings, parallel);
    MountedLens lens(scene), same_lens(larger);
    CaptureErrors errors(read_imaging_errors(JsonSource::from_text(R"({"target": {"scale": 1.05}})", "e")),
                         scene.sensor, 1, scene.emitter.side_mm);
    ASSERT_TRUE(errors.draw(1));
    Pixels found(scene.sensor.pixels()), wanted(found.size()), ideal(found.size());
    camera.capture(lens, nominal_pose(), 1, found.data(), errors.into_print());
    camera.capture(lens, nominal_pose(), 1, ideal.data());
    expected.capture(same_lens, nominal_pose(), 1, wanted.data());
    // Proportional to the side of the image.
    const auto extent = [&](const Pixels& image) {
      double sum = 0;
      for (const float value : image) sum += static_cast<double>(value);
      return std::sqrt(sum);
    };
    EXPECT_NEAR(extent(found), extent(wanted), 1e-3 * extent(wanted));
    EXPECT_GT(extent(found), 1.02 * extent(ideal)) << "distortion compresses the border";
    double difference = 0, change = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      difference += std::fabs(static_cast<double>(found[i] - wanted[i]));
      change += std::fabs(static_cast<double>(found[i] - ideal[i]));
    }
    EXPECT_LT(difference, 0.01 * change) << name_of(transport);
    Pixels again(found.size());
    camera.capture(lens, nominal_pose(), 1, again.data());
    EXPECT_EQ(again, ideal) << "the next capture without errors";
  }
}

TEST(ImagingErrors, IntoPrintUndoesScaleRotationAndShift) {
  CaptureErrors errors = errors_of(R"({"target": {"scale": 1.1, "shift": 0.02, "rotation_deg": 30}})");
  ASSERT_TRUE(errors.draw(1));
  const double cosine = std::cos(M_PI / 6), sine = 0.5;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {3.0, -7.0}}) {
    const optics::Vec3 found =
        errors.into_print()->point({1.1 * (cosine * x - sine * y) + 2, 1.1 * (sine * x + cosine * y) + 2, -5});
    EXPECT_NEAR(found.x, x, 1e-12);
    EXPECT_NEAR(found.y, y, 1e-12);
    EXPECT_EQ(found.z, -5);
  }
}

TEST(ImagingErrors, MistakesAreReportedWithTheirPositions) {
  const auto failure = [](const std::string& json) -> std::string {
    try {
      read_imaging_errors(JsonSource::from_text(json, "errors.json"));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(failure(R"({"gain": [1.2, 0.9]})"),
              HasSubstr("errors.json:1:10: /gain: expected a range [low, high], found"));
  EXPECT_THAT(failure(R"({"offset": "x"})"),
              HasSubstr("/offset: expected a number from -10 to 10 or a list of 2 numbers, found \"x\""));
  EXPECT_THAT(failure(R"({"drawn": "frame"})"), HasSubstr("found 'frame'; allowed: scene, capture"));
  EXPECT_THAT(failure(R"({"stray_light": {"men": 1}})"), HasSubstr("did you mean 'mean'?"));
  EXPECT_THAT(failure(R"({"stray_light": {"mean": 0.1, "blobs": 1.5}})"),
              HasSubstr("expected an integer from 0 to 16"));
  EXPECT_THAT(failure(R"({"bits": 8})"), HasSubstr("missing key 'full_scale'"));
  EXPECT_THAT(failure(R"({"full_scale": 3})"), HasSubstr("has no effect without 'bits' or 'hot_pixels'"));
  EXPECT_THAT(failure(R"({"bits": [0, 8], "full_scale": 3})"),
              HasSubstr("expected 0 (not rounded), or a range from 1"));
}

}  // namespace
}  // namespace relign::imaging
