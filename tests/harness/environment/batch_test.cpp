// A batch of instances against single trials of the same instances.
#include "environment/batch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "base/error.h"
#include "error_text.h"
#include "trials/stage.h"

namespace relign::environment {
namespace {

using plugin_host::Kind;
using test::error_text;
using testing::DoubleNear;
using testing::HasSubstr;
using testing::Pointwise;

class BatchOf : public testing::Test {
 protected:
  BatchOf() {
    catalog_.scan(RELIGN_PLUGIN_DIR);
    cache_ = std::filesystem::path(std::getenv("XDG_CACHE_HOME") != nullptr ? std::getenv("XDG_CACHE_HOME")
                                                                            : testing::TempDir());
  }

  BatchSetup setup(unsigned slots, unsigned threads, const Json& scene_parameters = {{"pixels", 32}}) {
    BatchSetup setup;
    setup.scene = catalog_.resolve_or_throw(Kind::scene, "relign_od", scene_parameters);
    setup.level = catalog_.resolve_or_throw(Kind::noise_level, "rho0.25");
    setup.slots = slots;
    setup.threads = threads;
    setup.cache_folder = cache_;
    return setup;
  }

  static std::vector<float> frame(const Batch& batch, unsigned slot) {
    const float* begin = batch.frames() + batch.frame_pixels() * slot;
    return {begin, begin + batch.frame_pixels()};
  }

  plugin_host::Catalog catalog_;
  std::filesystem::path cache_;
};

class BatchAt : public BatchOf, public testing::WithParamInterface<const char*> {};
// A linear stage, and one whose errors depend on the moves before and on machine time.
INSTANTIATE_TEST_SUITE_P(Levels, BatchAt, testing::Values("rho0.25", "tolerances-stepper-stage"));

TEST_P(BatchAt, MatchesFramesPosesAndGroundTruthOfATrial) {
  BatchSetup same = setup(2, 2);
  same.level = catalog_.resolve_or_throw(Kind::noise_level, GetParam());
  // The trial: eight random poses on benchmark instance 5.
  plugin_host::HostServices services;
  services.cache_folder = cache_;
  plugin_host::Scene scene(same.scene, services);
  const trials::SceneFacts facts = trials::facts_of(scene, "relign_od");
  plugin_host::NoiseLevel level(same.level, services);
  const trials::Instance instance = trials::draw_instance(level, facts, 1, SeedDomain::benchmark, 5);
  plugin_host::MountedAssembly assembly = scene.mount(instance.perturbations.elements_json);
  const plugin_host::Choice random = catalog_.resolve_or_throw(Kind::optimizer, "random");
  trials::ModelScene model(scene, same.scene, services);
  trials::TrialSetup trial{.stage = trials::SimulatedLens{assembly, model, level},
                           .reference = scene.reference(),
                           .scene = facts,
                           .instance = instance,
                           .algorithm = random,
                           .terms = {.budget = 8, .machine_time = facts.machine_time},
                           .services = services};
  std::vector<std::vector<float>> frames;
  trial.callbacks.on_step = [&](const trials::Step&, const float* pixels) {
    frames.emplace_back(pixels, pixels + std::size_t{facts.image_width} * facts.image_height);
  };
  const trials::TrialResult result = trials::run_trial(trial);
  ASSERT_EQ(result.steps.size(), 9u) << result.message;

  Batch batch(same);
  batch.reset({{0, SeedDomain::benchmark, 4}, {1, SeedDomain::benchmark, 5}});
  for (std::size_t k = 0;; ++k) {
    const trials::Step& step = result.steps[k];
    const Batch::State& state = batch.state(1);
    EXPECT_EQ(state.step, k);
    // Moves are differences of poses, so that their sum equals the trial's pose up to rounding; a frame of another seed
    // differs in most lit pixels.
    const std::vector<float> own = frame(batch, 1);
    std::size_t other_pixels = 0;
    for (std::size_t i = 0; i < own.size(); ++i) other_pixels += own[i] != frames[k][i] ? 1 : 0;
    EXPECT_LE(other_pixels, k == 0 ? 0 : own.size() / 200) << "step " << k;
    EXPECT_THAT(state.true_pose, Pointwise(DoubleNear(1e-12), step.true_pose));
    EXPECT_NEAR(state.measured_error, step.measured, 1e-5);
    EXPECT_NEAR(batch.truths({1}).front().mse, step.commanded_mse, 1e-9);
    if (k + 1 == result.steps.size()) break;
    std::vector<double> move = result.steps[k + 1].commanded_pose;
    for (std::size_t i = 0; i < move.size(); ++i) move[i] -= state.commanded_pose[i];
    batch.move_by({1}, move.data());
  }
  EXPECT_EQ(batch.state(0).step, 0u) << "the other slot stayed";
}

TEST_F(BatchOf, IsIndependentOfTheNumberOfThreads) {
  std::vector<std::vector<float>> seen;
  std::vector<double> optima;
  for (const unsigned threads : {1U, 2U, 5U}) {
    Batch batch(setup(5, threads));
    EXPECT_EQ(batch.threads(), threads);
    std::vector<Batch::Draw> draws;
    for (unsigned slot = 0; slot < 5; ++slot) draws.push_back({slot, SeedDomain::training, 100 + slot});
    batch.reset(draws);
    std::vector<double> moves(25);
    for (std::size_t i = 0; i < moves.size(); ++i) moves[i] = 0.01 * static_cast<double>(i) - 0.1;
    batch.move_by({0, 1, 2, 3, 4}, moves.data());
    batch.move_by({4, 1}, moves.data());
    std::vector<float> all(batch.frames(), batch.frames() + 5 * batch.frame_pixels());
    const auto best = batch.optima({2}).front();
    ASSERT_TRUE(best);
    if (seen.empty()) optima = best->true_pose;
    EXPECT_EQ(best->true_pose, optima);
    seen.push_back(std::move(all));
  }
  EXPECT_EQ(seen[0], seen[1]);
  EXPECT_EQ(seen[0], seen[2]);
}

TEST_F(BatchOf, DrawsRepeatableInstancesPerDomainAndNumber) {
  Batch batch(setup(3, 2));
  batch.reset({{0, SeedDomain::training, 7}, {1, SeedDomain::tuning, 7}, {2, SeedDomain::training, 8}});
  const std::vector<float> first = frame(batch, 0);
  EXPECT_NE(first, frame(batch, 1));
  EXPECT_NE(first, frame(batch, 2));
  batch.reset({{2, SeedDomain::training, 7}});
  EXPECT_EQ(first, frame(batch, 2));
}

TEST_F(BatchOf, CapturesAtAnyPoseWithoutMoving) {
  Batch batch(setup(2, 1));
  batch.reset({{0, SeedDomain::training, 1}, {1, SeedDomain::training, 2}});
  const std::vector<double> before = batch.state(0).true_pose;
  const std::vector<double> poses = {0.5, 0.5, 0.5, 0.5, 0.5, 0.4, 0.5, 0.6, 0.5, 0.5};
  const std::vector<std::uint64_t> seeds = {11, 12};
  std::vector<float> twice(4 * batch.frame_pixels());
  batch.capture_at({0, 1}, poses.data(), seeds.data(), twice.data());
  batch.capture_at({0, 1}, poses.data(), seeds.data(), twice.data() + 2 * batch.frame_pixels());
  const auto half = static_cast<std::ptrdiff_t>(2 * batch.frame_pixels());
  EXPECT_TRUE(std::equal(twice.begin(), twice.begin() + half, twice.begin() + half));
  EXPECT_GT(*std::max_element(twice.begin(), twice.begin() + half), 0.0F);
  std::vector<float> clean(2 * batch.frame_pixels());
  batch.render_at({0, 1}, poses.data(), clean.data());
  EXPECT_FALSE(std::equal(clean.begin(), clean.end(), twice.begin()));
  EXPECT_EQ(batch.state(0).true_pose, before);
}

TEST_F(BatchOf, LeavesOutThePaddingOfAReference) {
  BatchSetup padded = setup(1, 1);
  padded.scene = catalog_.resolve_or_throw(Kind::scene, RELIGN_PADDED_SCENE);
  EXPECT_EQ(Batch(padded).reference(), std::vector<float>(6, 0.5F));
}

TEST_F(BatchOf, RejectsInvalidArguments) {
  Batch batch(setup(2, 1));
  const double move[5] = {};
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { batch.move_by({0}, move); }), HasSubstr("slot 0 has no lens yet"));
  EXPECT_THAT(error_text(ErrorKind::bad_input,
                         [&] {
                           batch.reset({{2, SeedDomain::training, 0}});
                         }),
              HasSubstr("expected 0 to 1"));
  EXPECT_THAT(error_text(ErrorKind::bad_input,
                         [&] {
                           batch.reset({{1, SeedDomain::training, 0}, {1, SeedDomain::training, 1}});
                         }),
              HasSubstr("given twice"));
  batch.reset({{0, SeedDomain::training, 0}});
  const double bad[5] = {0, 0, std::nan(""), 0, 0};
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { batch.move_by({0}, bad); }), HasSubstr("non-finite"));
  EXPECT_EQ(batch.state(0).step, 0u) << "nothing moved";
  const double outside[5] = {0.5, 0.5, 1.01, 0.5, 0.5};
  const std::uint64_t seed = 1;
  std::vector<float> pixels(batch.frame_pixels());
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { batch.capture_at({0}, outside, &seed, pixels.data()); }),
              HasSubstr("outside [0, 1]"));
}

}  // namespace
}  // namespace relign::environment
