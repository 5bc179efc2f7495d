#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "contract/fake_conversation.h"
#include "plugin_host/objects.h"

namespace relign {
namespace {

using testing::AllOf;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

// Grey images for the network of tests/golden/policies: axis 0 is the brightness of the newest frame, axis 1 half that
// of the frame before.
struct GreyTrial {
  explicit GreyTrial(double brightness, double reference_value = 0) {
    setup.axes = 2;
    setup.budget = 6;
    setup.knows = RELIGN_KNOWS_IMAGES;
    setup.largest_move = 0.2;
    setup.image_side = 40;
    setup.merit = [](const test::Pose&, std::uint32_t) { return 0.0; };
    setup.paint = [brightness](double, float* pixels) {
      std::fill(pixels, pixels + 1600, static_cast<float>(brightness * 0.3));  // 255 stands for three whites of 0.1
    };
    wanted.assign(1600, static_cast<float>(reference_value));
    image = {sizeof image, RELIGN_SAMPLE_FLOAT32, 40, 40, 1, 0, wanted.data(), 40 * sizeof(float)};
    reference.struct_size = sizeof reference;
    reference.image = &image;
    setup.service = [this](std::string_view id) -> const void* {
      return id == RELIGN_SERVICE_REFERENCE ? &reference : nullptr;
    };
  }
  test::FakeSetup setup;
  std::vector<float> wanted;
  relign_image image{};
  relign_reference_service reference{};
};

void run(const test::FakeConversation& conversation, Json parameters = Json::object()) {
  plugin_host::Catalog catalog;
  catalog.add(std::string(RELIGN_PLUGIN_DIR) + "/imitation");
  if (!parameters.contains("model"))
    parameters["model"] = std::string(RELIGN_SOURCE_DIR) + "/tests/golden/policies/tiny.onnx";
  plugin_host::Algorithm algorithm(catalog.resolve_or_throw(plugin_host::Kind::agent, "imitation", parameters), {});
  algorithm.run(conversation.talk());
}

std::string refusal(const test::FakeConversation& conversation, const Json& parameters = Json::object()) {
  try {
    run(conversation, parameters);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

TEST(Imitation, FollowsGuessesWholeThenAShareOfThem) {
  GreyTrial trial(0.12);
  test::FakeConversation conversation(trial.setup);
  run(conversation, {{"whole_guesses", 3}});
  ASSERT_EQ(conversation.steps.size(), 6u);
  std::vector<double> first_axis, second_axis;
  test::Pose before(2, 0.0);
  for (const auto& visit : conversation.steps) {
    first_axis.push_back(visit.pose[0] - before[0]);
    second_axis.push_back(visit.pose[1] - before[1]);
    before = visit.pose;
  }
  const auto near = [](double value) { return DoubleNear(value, 0.002); };  // bytes are rounded
  EXPECT_THAT(first_axis, ElementsAre(near(0.12), near(0.12), near(0.12), near(0.06), near(0.04), near(0.03)));
  // Before the start there is darkness.
  EXPECT_THAT(second_axis, ElementsAre(near(0), near(0.06), near(0.06), near(0.03), near(0.02), near(0.015)));
}

TEST(Imitation, MovesAreCutAndRecommendationsAreNot) {
  GreyTrial trial(0.8);
  test::FakeConversation conversation(trial.setup);
  run(conversation);
  EXPECT_NEAR(conversation.steps[0].pose[0], 0.2, 1e-12);
  ASSERT_EQ(conversation.recommendations.size(), 7u);  // from step 0 on
  EXPECT_NEAR(conversation.recommendations[0].pose[0], 0.8, 0.002);
  EXPECT_EQ(conversation.recommendations[0].steps_made, 0u);
  EXPECT_NEAR(conversation.recommendations[1].pose[0], 1.0, 0.002);
}

TEST(Imitation, AnotherSceneIsRefusedWithTheCommandThatHelps) {
  GreyTrial brighter(0.1, 0.001);
  test::FakeConversation conversation(brighter.setup);
  EXPECT_THAT(refusal(conversation),
              AllOf(HasSubstr("the reference image of this scene is another"), HasSubstr("relign-train imitate")));
  EXPECT_TRUE(conversation.steps.empty());
  test::FakeConversation allowed(brighter.setup);
  EXPECT_EQ(refusal(allowed, {{"other_scenes", true}}), "");
  EXPECT_EQ(allowed.steps.size(), 6u);
}

TEST(Imitation, OtherAxesAndImagesAreRefused) {
  GreyTrial trial(0.1);
  trial.setup.axes = 3;
  test::FakeConversation three(trial.setup);
  EXPECT_THAT(refusal(three, {{"other_scenes", true}}), HasSubstr("trained to move 2 axes, this scene has 3"));
  GreyTrial odd(0.1);
  odd.image.width = odd.image.height = 30;
  test::FakeConversation thirty(odd.setup);
  EXPECT_THAT(refusal(thirty), AllOf(HasSubstr("30 x 30 cannot be binned"), HasSubstr("relign-train imitate")));
}

TEST(Imitation, TheShippedNetworkIsForTheScenesFiveAxes) {
  GreyTrial trial(0.1);
  test::FakeConversation conversation(trial.setup);
  const std::string shipped = std::string(RELIGN_PLUGIN_DIR) + "/imitation/imitation.onnx";
  EXPECT_THAT(refusal(conversation, {{"model", shipped}}), HasSubstr("trained to move 5 axes, this scene has 2"));
}

}  // namespace
}  // namespace relign
