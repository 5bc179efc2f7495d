// Images of several wavelengths: weighted sums of the images at one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

#include "error_text.h"
#include "imaging/own_optimum.h"
#include "imaging/sequences.h"
#include "optics/glass.h"
#include "wavelengths_under_test.h"

namespace relign::imaging {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::vector<float> render(const SceneFile& scene, const std::vector<double>& pose, std::uint64_t seed, int samples) {
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  std::vector<float> image(scene.sensor.pixels());
  camera.render_noise_free(lens, pose, seed, samples, image.data());
  return image;
}

const std::vector<double>& off_pose() {
  static const std::vector<double> pose = {0.53, 0.48, 0.5, 0.55, 0.46};
  return pose;
}

TEST(Wavelengths, UseGlassIndicesAndUnchangedGeometry) {
  const SceneFile scene = scene_with_wavelengths("cooke_triplet", kThreeWavelengths);
  ASSERT_EQ(scene.wavelengths.size(), 3u);
  EXPECT_EQ(scene.lens.wavelength_nm, 550);
  const double weights[] = {1 / 4.5, 2 / 4.5, 1.5 / 4.5};
  for (std::size_t i = 0; i < 3; ++i) {
    const SceneWavelength& one = scene.wavelengths[i];
    EXPECT_NEAR(one.weight, weights[i], 1e-15);
    for (std::size_t e = 0; e < 3; ++e) {
      const optics::Face& face = one.lens.elements[e].faces[0];
      const char* glass = e == 1 ? "F2" : "SK16";
      EXPECT_EQ(face.index_after, optics::refractive_index(*optics::find_glass(glass), one.lens.wavelength_nm));
      EXPECT_EQ(face.curvature, scene.lens.elements[e].faces[0].curvature);
      EXPECT_EQ(face.clear_radius_mm, scene.lens.elements[e].faces[0].clear_radius_mm);
    }
  }
}

TEST(Wavelengths, SingleWavelengthEqualsNoList) {
  const SceneFile without = scene_with_wavelengths("cooke_triplet", "", 40);
  const SceneFile with = scene_with_wavelengths("cooke_triplet", R"([{"nm": 550, "weight": 3}])", 40);
  EXPECT_EQ(scene_content_hash(without, {}), scene_content_hash(with, {}));
  Parallel parallel(2);
  std::vector<float> images[2];
  double truths[2];
  const SceneFile* scenes[] = {&without, &with};
  for (int i = 0; i < 2; ++i) {
    Camera camera(*scenes[i], {}, parallel);
    MountedLens lens(*scenes[i]);
    images[i].resize(scenes[i]->sensor.pixels());
    camera.capture(lens, off_pose(), 7, images[i].data());
    truths[i] = camera.noise_free_mse(lens, off_pose(), 3, make_reference(*scenes[i], {}, parallel, {}, {})).mse;
  }
  EXPECT_EQ(images[0], images[1]);
  EXPECT_EQ(truths[0], truths[1]);
}

TEST(Wavelengths, SingleWavelengthSetsTheLens) {
  const SceneFile scene = scene_with_wavelengths("cooke_triplet", R"([{"nm": 650}])", 40);
  EXPECT_TRUE(scene.wavelengths.empty());
  EXPECT_EQ(scene.lens.wavelength_nm, 650);
  EXPECT_EQ(scene.lens.elements[1].faces[0].index_after, optics::refractive_index(*optics::find_glass("F2"), 650));
}

TEST(Wavelengths, ImagesAreWeightedSums) {
  constexpr int kPixels = 60, kSamples = 1024;
  const SceneFile all = scene_with_wavelengths(
      "petzval", R"([{"nm": 430, "weight": 1}, {"nm": 587.56, "weight": 2}, {"nm": 850, "weight": 1.5}])", kPixels);
  const std::vector<double> pose = {0.52, 0.49, 0.5, 0.51, 0.5};
  const std::vector<float> first = render(all, pose, 1, kSamples), second = render(all, pose, 2, kSamples);
  const char* const singles[] = {R"([{"nm": 430}])", R"([{"nm": 587.56}])", R"([{"nm": 850}])"};
  std::vector<double> one(first.size()), other(first.size());
  double largest_apart = 0;  // of what two wavelengths show
  std::vector<float> previous;
  for (std::size_t i = 0; i < 3; ++i) {
    const SceneFile single = scene_with_wavelengths("petzval", singles[i], kPixels);
    const std::vector<float> a = render(single, pose, 3, kSamples), b = render(single, pose, 4, kSamples);
    for (std::size_t p = 0; p < a.size(); ++p) {
      one[p] += all.wavelengths[i].weight * static_cast<double>(a[p]);
      other[p] += all.wavelengths[i].weight * static_cast<double>(b[p]);
      if (!previous.empty())
        largest_apart = std::max(largest_apart, std::fabs(static_cast<double>(a[p] - previous[p])));
    }
    previous = a;
  }
  // Squared differences, compared with those between two renders of each side.
  double between = 0, within = 0;
  for (std::size_t p = 0; p < one.size(); ++p) {
    const double ours = 0.5 * static_cast<double>(first[p] + second[p]), theirs = 0.5 * (one[p] + other[p]);
    between += (ours - theirs) * (ours - theirs);
    const double d = static_cast<double>(first[p] - second[p]), e = one[p] - other[p];
    within += (d * d + e * e) / 4;
  }
  const double count = static_cast<double>(one.size());
  std::printf("rms of differences %.2e, of the renders' errors %.2e\n", std::sqrt(between / count),
              std::sqrt(within / count));
  EXPECT_GT(largest_apart, 10 * std::sqrt(within / count)) << "the wavelengths differ enough to be distinguished";
  EXPECT_NEAR(between / within, 1, 0.2);
}

TEST(Wavelengths, CapturesAreUnbiasedWithEqualNoise) {
  constexpr int kPixels = 30, kCaptures = 200, kRenders = 8;
  const SceneFile all = scene_with_wavelengths("petzval", kThreeWavelengths, kPixels);
  const SceneFile single = scene_with_wavelengths("petzval", "", kPixels);
  std::vector<double> exact(all.sensor.pixels());
  for (std::uint64_t seed = 0; seed < kRenders; ++seed) {
    const std::vector<float> one = render(all, off_pose(), seed, 4096);
    for (std::size_t p = 0; p < one.size(); ++p) exact[p] += static_cast<double>(one[p]) / kRenders;
  }
  Parallel parallel(2);
  for (const Sampler sampler : {Sampler::paper, Sampler::hemisphere, Sampler::pupil})
    for (const int samples : {5, 64}) {  // 5: no whole shares
      double variance[2] = {0, 0}, off = 0;
      for (int which = 0; which < 2; ++which) {
        const SceneFile& scene = which == 0 ? all : single;
        Camera camera(scene, {Transport::fresnel, sampler, samples}, parallel);
        MountedLens lens(scene);
        std::vector<float> image(scene.sensor.pixels());
        std::vector<double> sum(image.size()), squares(image.size());
        for (int i = 0; i < kCaptures; ++i) {
          camera.capture(lens, off_pose(), static_cast<std::uint64_t>(i), image.data());
          for (std::size_t p = 0; p < image.size(); ++p) {
            sum[p] += static_cast<double>(image[p]) / kCaptures;
            squares[p] += static_cast<double>(image[p]) * static_cast<double>(image[p]) / kCaptures;
          }
        }
        for (std::size_t p = 0; p < image.size(); ++p) {
          const double own = squares[p] - sum[p] * sum[p];
          variance[which] += own;
          if (which == 0) off += (sum[p] - exact[p]) * (sum[p] - exact[p]);
        }
      }
      const char* name = sampler == Sampler::paper ? "paper" : sampler == Sampler::pupil ? "pupil" : "hemisphere";
      std::printf("%s, %d samples: mean squares off over variance %.3f, variance against one wavelength %.3f\n", name,
                  samples, off * kCaptures / variance[0], variance[0] / variance[1]);
      EXPECT_NEAR(off * kCaptures / variance[0], 1, 0.25) << name << samples;
      if (samples == 64 && sampler != Sampler::pupil) {
        EXPECT_NEAR(variance[0] / variance[1], 1, 0.05) << name;
      }
    }
}

TEST(Wavelengths, ImagesAndMseDoNotDependOnThreads) {
  const SceneFile scene = scene_with_wavelengths("tessar", kThreeWavelengths, 40);
  Parallel one(1);
  const Reference reference = make_reference(scene, {}, one, {}, {});
  std::vector<float> images[3];
  double truths[3];
  const unsigned threads[] = {1, 2, 7};
  for (int i = 0; i < 3; ++i) {
    Parallel parallel(threads[i]);
    Camera camera(scene, {}, parallel);
    MountedLens lens(scene);
    images[i].resize(scene.sensor.pixels());
    camera.capture(lens, off_pose(), 7, images[i].data());
    truths[i] = camera.noise_free_mse(lens, off_pose(), 7, reference).mse;
  }
  EXPECT_EQ(images[0], images[1]);
  EXPECT_EQ(images[0], images[2]);
  EXPECT_EQ(truths[0], truths[1]);
  EXPECT_EQ(truths[0], truths[2]);
}

// With more wavelengths than rays of a group, too.
TEST(Wavelengths, MseIsUnbiasedWithCorrectError) {
  std::string twelve = "[";
  for (int i = 0; i < 12; ++i)
    twelve += (i ? ", " : "") + std::string(R"({"nm": )") + std::to_string(420 + 25 * i) + R"(, "weight": )" +
              std::to_string(1 + i % 3) + "}";
  twelve += "]";
  for (const bool diffraction : {false, true})
    for (const std::string& list : {std::string(kThreeWavelengths), twelve}) {
      SceneFile scene = scene_with_wavelengths("petzval", list, 40);
      scene.diffraction = diffraction;
      Parallel parallel(2);
      const Reference reference = make_reference(scene, {}, parallel, {}, {});
      Camera camera(scene, {}, parallel);
      MountedLens lens(scene);
      std::vector<float> exact(scene.sensor.pixels());
      camera.render_noise_free(lens, off_pose(), 9, 16384, exact.data());
      double wanted = 0;
      for (std::size_t i = 0; i < exact.size(); ++i) {
        const double one = static_cast<double>(exact[i] - reference.first[i]);
        wanted += one * static_cast<double>(exact[i] - reference.second[i]) / static_cast<double>(exact.size());
      }
      constexpr int kSeeds = 200;
      double sum = 0, squares = 0, claimed = 0;
      for (int seed = 0; seed < kSeeds; ++seed) {
        const MseEstimate found =
            camera.noise_free_mse(lens, off_pose(), 100U + static_cast<unsigned>(seed), reference);
        sum += found.mse / kSeeds;
        squares += found.mse * found.mse / kSeeds;
        claimed += found.standard_error / kSeeds;
      }
      const double spread = std::sqrt(squares - sum * sum);
      std::printf("%zu wavelengths%s: MSE %.4e, images %.4e, spread %.1e, claimed %.1e\n", scene.wavelengths.size(),
                  diffraction ? ", diffraction" : "", sum, wanted, spread, claimed);
      EXPECT_NEAR(sum, wanted, 4 * spread / std::sqrt(kSeeds));
      EXPECT_NEAR(claimed / spread, 1, 0.35);
    }
}

std::string mistake(const std::string& scene, const std::string& wavelengths) {
  return test::error_text(ErrorKind::bad_input, [&] { scene_with_wavelengths(scene, wavelengths); });
}

TEST(Wavelengths, ReportsMistakesWithPosition) {
  EXPECT_THAT(mistake("cooke_triplet", "[]"), AllOf(HasSubstr("/wavelengths"), HasSubstr("1 to 24")));
  EXPECT_THAT(mistake("cooke_triplet", "550"), HasSubstr("/wavelengths"));
  EXPECT_THAT(mistake("cooke_triplet", R"([{"weight": 1}])"), HasSubstr("/wavelengths/0"));
  EXPECT_THAT(mistake("cooke_triplet", R"([{"nm": 550, "weight": 0}])"), HasSubstr("/wavelengths/0/weight"));
  EXPECT_THAT(mistake("cooke_triplet", R"([{"nm": 550, "weight": -1}])"), HasSubstr("/wavelengths/0/weight"));
  EXPECT_THAT(mistake("cooke_triplet", R"([{"nm": 550, "wieght": 1}])"), HasSubstr("did you mean 'weight'?"));
  EXPECT_THAT(mistake("cooke_triplet", R"([{"nm": 550}, {"nm": 550}])"),
              AllOf(HasSubstr("/wavelengths/1/nm"), HasSubstr("listed twice")));
  EXPECT_THAT(mistake("cooke_triplet", R"([{"nm": 550}, {"nm": 20}])"),
              AllOf(HasSubstr("lens.json:"), HasSubstr("glass_after"), HasSubstr("at 20 nm")));
  EXPECT_THAT(mistake("relign_od", R"([{"nm": 550}, {"nm": 600}])"),
              AllOf(HasSubstr("lens.json:"), HasSubstr("/elements/0/faces/0/index_after"), HasSubstr("glass of L1")));
}

TEST(Wavelengths, RejectsFeaturesForOneWavelength) {
  const SceneFile scene = scene_with_wavelengths("cooke_triplet", kThreeWavelengths, 20);
  Parallel parallel(1);
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { Camera(scene, {Transport::ghost}, parallel); }),
              HasSubstr("transport 'ghost'"));
  EXPECT_THAT(test::error_text(ErrorKind::bad_input,
                               [&] {
                                 Camera(scene, {Transport::fresnel, Sampler::paper, 2}, parallel);
                               }),
              AllOf(HasSubstr("3 wavelengths"), HasSubstr("found 'samples' 2")));
  class NoTracer final : public optics::BlockTracer {
   public:
    void place(const optics::Assembly&, const optics::Motion&, const optics::BackwardPath&) override {}
    void trace(optics::RayBlock&, bool, int) const override {}
  } tracer;
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { Camera(scene, {}, parallel, &tracer); }),
              HasSubstr("meshes"));
}

TEST(Wavelengths, PerfectLensHasNominalOptimum) {
  const SceneFile scene = scene_with_wavelengths("petzval", kThreeWavelengths, 60);
  Parallel parallel(2);
  const Reference reference = make_reference(scene, {}, parallel, {}, {});
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene);
  const OwnOptimum best = OptimumFinder(scene, {}, camera, parallel, reference).find(lens, 1);
  EXPECT_LT(best.error.mse, 5 * best.error.standard_error + 1e-7);
}

// Images miss no light at any wavelength, however far from the lens's own.
TEST(Wavelengths, EachIsCertified) {
  std::string many = "[";
  for (int i = 0; i < 24; ++i) many += (i ? R"(, {"nm": )" : R"({"nm": )") + std::to_string(380 + 30 * i) + "}";
  many += "]";
  Parallel parallel(2);
  Random random(5);
  for (const char* name : {"cooke_triplet", "petzval", "tessar"}) {
    const SceneFile scene = scene_with_wavelengths(name, many, 60);
    Camera camera(scene, {}, parallel);
    MountedLens lens(scene);
    camera.certify(lens, nominal_pose(), {}, 1);
    camera.certify(lens, random_pose(random), {0, 64}, 2);
  }
}

TEST(Sequences, AllocatesByLargestRemainders) {
  EXPECT_THAT(allocate_samples(64, {1}), testing::ElementsAre(64));
  EXPECT_THAT(allocate_samples(64, {0.25, 0.5, 0.25}), testing::ElementsAre(16, 32, 16));
  EXPECT_THAT(allocate_samples(10, {0.47, 0.24, 0.16, 0.13}), testing::ElementsAre(5, 2, 2, 1));
  EXPECT_THAT(allocate_samples(3, {0.998, 0.001, 0.001}), testing::ElementsAre(1, 1, 1));
}

}  // namespace
}  // namespace relign::imaging
