// Complete trials of the agent on a toy lens, with the service `model`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "contract/run_plugin.h"
#include "toy_lens.h"

namespace relign {
namespace {

using test::FakeSetup;
using test::FakeTrial;
using test::Pose;

constexpr std::uint32_t kSide = toy::kSide;

// The lens is the toy with another best pose; the model is the toy as designed.
struct SensitivityTrial {
  SensitivityTrial(std::uint32_t axes, std::uint64_t seed, unsigned budget) : start(axes), optimum(axes) {
    Random random(seed);
    for (double& coordinate : start) coordinate = random.uniform(0.15, 0.85);
    for (double& coordinate : optimum) coordinate = random.uniform(0.45, 0.55);
    reference_pixels = toy::paint(Pose(axes, 0.5));
    reference_image = view(reference_pixels);
    reference.struct_size = sizeof reference;
    reference.image = &reference_image;
    describe_model(axes);
    setup.axes = axes;
    setup.budget = budget;
    setup.seed = seed;
    setup.observes = RELIGN_OBSERVES_IMAGES | RELIGN_OBSERVES_DESIGN;
    setup.image_side = kSide;
    setup.largest_move = 0.2;
    setup.merit = [this](const Pose& commanded, std::uint32_t step) {
      Pose seen(commanded.size());
      for (std::size_t axis = 0; axis < seen.size(); ++axis)
        seen[axis] = 0.5 + start[axis] + commanded[axis] - optimum[axis];
      shown = dark ? std::vector<float>(kSide * kSide) : toy::paint(seen);
      toy::add_noise(noise, 1000 * setup.seed + step, shown);
      return 0.0;
    };
    setup.paint = [this](double, float* pixels) { std::copy(shown.begin(), shown.end(), pixels); };
    setup.service = [this](std::string_view id) -> const void* {
      if (id == RELIGN_SERVICE_REFERENCE) return &reference;
      return id == RELIGN_SERVICE_MODEL ? &model : nullptr;
    };
  }

  static relign_image view(const std::vector<float>& pixels) {
    return {sizeof(relign_image), RELIGN_SAMPLE_FLOAT32, kSide, kSide, 1, 0, pixels.data(), kSide * sizeof(float)};
  }

  void describe_model(std::uint32_t axes) {
    scene = R"({"nominal_pose": [)";
    for (std::uint32_t axis = 0; axis < axes; ++axis) scene += axis ? ", 0.5" : "0.5";
    scene += "]}";
    model.struct_size = sizeof model;
    model.context = this;
    model.scene_json = {scene.data(), scene.size()};
    model.image_width = model.image_height = kSide;
    model.mount = [](void* self, relign_text, relign_model_lens** made) {
      *made = static_cast<relign_model_lens*>(self);
      return relign_status{RELIGN_OK};
    };
    model.unmount = [](void*, relign_model_lens*) { return relign_status{RELIGN_OK}; };
    model.capture = [](void* self, relign_model_lens*, const double* pose, std::uint32_t count, std::uint64_t seed,
                       float* pixels) {
      auto& toy = *static_cast<SensitivityTrial*>(self);
      if (++toy.captures == toy.stop_at) return relign_status{RELIGN_STOP};
      std::vector<float> made = toy::paint(Pose(pose, pose + count));
      toy::add_noise(toy.noise, seed, made);
      std::copy(made.begin(), made.end(), pixels);
      return relign_status{RELIGN_OK};
    };
    model.noise_free = [](void* self, relign_model_lens*, const double* pose, std::uint32_t count, float* pixels) {
      auto& toy = *static_cast<SensitivityTrial*>(self);
      ++toy.renderings;
      if (!toy.renders) return relign_status{RELIGN_UNSUPPORTED};
      const std::vector<float> made = toy::paint(Pose(pose, pose + count));
      std::copy(made.begin(), made.end(), pixels);
      return relign_status{RELIGN_OK};
    };
  }

  SensitivityTrial& run(const std::string& id = "sensitivity", const Json& parameters = {}) {
    trial = std::make_unique<FakeTrial>(setup);
    test::run_plugin("sensitivity", id, parameters, *trial);
    return *this;
  }

  // Largest distance from the best pose over the axes.
  double miss(const Pose& commanded) const {
    double worst = 0;
    for (std::size_t axis = 0; axis < commanded.size(); ++axis)
      worst = std::max(worst, std::fabs(start[axis] + commanded[axis] - optimum[axis]));
    return worst;
  }
  double last_miss() const { return miss(trial->recommendations.back().pose); }

  Pose start, optimum;
  double noise = 0.05;
  bool dark = false, renders = true;
  int captures = 0, renderings = 0, stop_at = -1;
  FakeSetup setup;
  std::unique_ptr<FakeTrial> trial;

 private:
  std::vector<float> reference_pixels, shown;
  std::string scene;
  relign_image reference_image{};
  relign_reference_service reference{};
  relign_model_service model{};
};

TEST(Sensitivity, FindsBestPoseInSixMoves) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SensitivityTrial toy(5, seed, 6);
    EXPECT_LT(toy.run().last_miss(), 0.03) << seed;
  }
}

TEST(Sensitivity, ImprovesByAveraging) {
  double soon = 0, late = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    SensitivityTrial toy(5, seed, 30);
    toy.noise = 0.1;
    toy.run();
    for (const auto& one : toy.trial->recommendations) {
      if (one.steps_made == 6) soon += toy.miss(one.pose);
      if (one.steps_made == 30) late += toy.miss(one.pose);
    }
  }
  EXPECT_LT(late, 0.7 * soon);
}

TEST(Sensitivity, LinearPresetConverges) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SensitivityTrial toy(5, seed, 40);
    EXPECT_LT(toy.run("sensitivity-linear").last_miss(), 0.05) << seed;
  }
}

TEST(Sensitivity, RecommendsPoseOfNextMoveAtEveryStep) {
  for (const char* id : {"sensitivity", "sensitivity-linear"}) {
    SensitivityTrial toy(5, 3, 12);
    toy.run(id);
    ASSERT_EQ(toy.trial->recommendations.size(), 13u);
    Pose here(5, 0.0);
    for (std::size_t made = 0; made <= 12; ++made) {
      const auto& one = toy.trial->recommendations[made];
      EXPECT_EQ(one.steps_made, made);
      for (std::size_t axis = 0; axis < 5; ++axis) EXPECT_LE(std::fabs(one.pose[axis] - here[axis]), 0.2 + 1e-12);
      here = one.pose;
      if (made == 12) break;
      EXPECT_EQ(toy.trial->steps[made].pose, here);
    }
  }
}

TEST(Sensitivity, StopsOnceCertain) {
  std::size_t before = 0;
  for (const double limit : {0.01, 0.002}) {
    std::size_t recommendations = 0;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      SensitivityTrial toy(5, seed, 30);
      toy.run("sensitivity", {{"stop_below", limit}});
      Pose seen = toy.trial->recommendations.back().pose;
      for (std::size_t axis = 0; axis < 5; ++axis) seen[axis] += toy.start[axis] - toy.optimum[axis] + 0.5;
      const std::vector<float> ideal = toy::paint(Pose(5, 0.5)), left = toy::paint(seen);
      double squares = 0;
      for (std::size_t k = 0; k < ideal.size(); ++k) squares += std::pow(left[k] - ideal[k], 2);
      EXPECT_LT(std::sqrt(squares / static_cast<double>(ideal.size())), 2.5 * limit) << seed;
      recommendations += toy.trial->recommendations.size();
    }
    EXPECT_GT(recommendations, before) << limit;
    EXPECT_LT(recommendations, 5u * 31u) << limit;
    before = recommendations;
  }
}

TEST(Sensitivity, AcceptsAnyNumberOfAxesAndBudgetOfOne) {
  for (const std::uint32_t axes : {1u, 2u, 3u, 6u, 10u}) {
    SensitivityTrial toy(axes, 2, 8);
    EXPECT_LT(toy.run().miss(toy.trial->recommendations.back().pose), axes > 5 ? 1 : 0.03) << axes;
    SensitivityTrial once(axes, 2, 1);
    EXPECT_EQ(once.run().trial->recommendations.size(), 2u);
  }
}

TEST(Sensitivity, AveragesCapturesWithoutNoiseFreeImages) {
  SensitivityTrial toy(5, 4, 8);
  toy.renders = false;
  // A first_blur that no other test uses, so that the design is not cached.
  EXPECT_LT(toy.run("sensitivity", {{"first_blur", 0.11}}).last_miss(), 0.05);
  EXPECT_GT(toy.captures, 1000);
}

TEST(Sensitivity, CachedDesignGivesTheSameSteps) {
  const Json parameters = {{"first_blur", 0.12}};
  SensitivityTrial first(5, 5, 5), second(5, 5, 5);
  first.run("sensitivity", parameters);
  second.run("sensitivity", parameters);
  EXPECT_GT(first.renderings, 10);
  EXPECT_EQ(second.renderings, 0);
  for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(first.trial->steps[k].pose, second.trial->steps[k].pose);
}

TEST(Sensitivity, AlignsWithoutNoise) {
  SensitivityTrial toy(5, 6, 8);
  toy.noise = 0;
  EXPECT_LT(toy.run("sensitivity", {{"first_blur", 0.13}}).last_miss(), 0.01);
}

TEST(Sensitivity, SendsValidPosesForDarkCaptures) {
  SensitivityTrial toy(5, 7, 10);
  toy.dark = true;
  toy.run();
  EXPECT_FALSE(toy.trial->refused);
  EXPECT_EQ(toy.trial->steps.size(), 10u);
}

TEST(Sensitivity, ReturnsWhenStoppedInTheModel) {
  SensitivityTrial toy(5, 8, 10);
  toy.stop_at = 30;
  EXPECT_NO_THROW(toy.run());
  EXPECT_EQ(toy.captures, 30);
}

TEST(Sensitivity, RejectsSceneWithoutModel) {
  SensitivityTrial toy(5, 9, 10);
  toy.setup.service = [service = toy.setup.service](std::string_view id) -> const void* {
    return id == RELIGN_SERVICE_MODEL ? nullptr : service(id);
  };
  try {
    toy.run();
    FAIL() << "no exception";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("relign.model/1 is not offered"));
  }
}

}  // namespace
}  // namespace relign
