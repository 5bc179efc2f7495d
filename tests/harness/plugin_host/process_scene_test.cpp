// Scenes and noise levels that run as processes: requests, answers and every kind of fault, message by message.
#include <gmock/gmock.h>

#include <limits>

#include "base/json_source.h"
#include "process_folder.h"

namespace relign::plugin_host {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

// Answers of a scene of 3 x 2 pixels, written without relign_bench; each case replaces one.
const char* const kScene = R"(
import array
def write(values, mode="wb"):
    with open(image_file, mode) as file: array.array("f", values).tofile(file)
def answer_describe(asked):
    return '{"message":"described","description":{"name":"raw","owns_stage":true,"image":{"width":3,"height":2}}}'
def answer_reference(asked): write(range(6)); return '{"message":"ok"}'
def answer_begin(asked): return '{"message":"ok"}'
def answer_move_by(asked):
    return '{"message":"moved","moved":[0.5,-0.25],"limits_low":2,"limits_high":1,"machine_seconds":0.125}'
def answer_capture(asked): write([0.5] * 6); return '{"message":"captured","machine_seconds":1.5}'
)";
const char* const kServeScene = R"(
greet()
while True:
    asked = hear()
    if asked["message"] == "bye": break
    image_file = asked.get("image_file") or image_file
    say(globals()["answer_" + asked["message"]](asked) + "\n")
)";

class ProcessSceneTest : public test::ProcessFolderTest {
 protected:
  std::unique_ptr<Scene> station(const std::string& answers = "") {
    return std::make_unique<Scene>(choice(Kind::scene, raw(kScene + answers + kServeScene, "scene")), services_);
  }
  // The failure of a station with an answer replaced by `instead`: describe and reference, then one step.
  std::string failure(const std::string& instead) {
    return test::error_text(ErrorKind::plugin_failed, [&] {
      const auto scene = station(instead + "\n");
      scene->reference();
      std::vector<float> pixels(6);
      scene->begin(1);
      scene->move_by({0.5, -0.25});
      scene->capture(pixels.data());
    });
  }
};

TEST_F(ProcessSceneTest, RequestsListedAbilitiesOnly) {
  const auto scene = station(R"(
def answer_describe(asked):
    return ('{"message":"described","abilities":["mtf","own_optimum","later"],'
            '"description":{"name":"raw","image":{"width":3,"height":2}}}')
def answer_mount(asked): return '{"message":"ok"}'
def answer_ability(asked):
    if asked["ability"] == "own_optimum": return '{"message":"result","true_pose":[],"mse":1}'
    assert asked == {"message": "ability", "ability": "mtf", "assembly": 1, "pose": [0.5, 0.25], "lp_per_mm": 20}
    return '{"message":"result","centre":0.5,"corner":0.25}'
)");
  MountedAssembly lens = scene->mount("{}");
  const auto mtf = lens.mtf({0.5, 0.25}, 20);
  ASSERT_TRUE(mtf);
  EXPECT_EQ(mtf->corner, 0.25);
  std::vector<float> pixels(6);
  EXPECT_FALSE(lens.render_noise_free({0.5, 0.25}, pixels.data()));
  EXPECT_FALSE(lens.captures_regions());
  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed, [&] { lens.own_optimum(1); }),
              HasSubstr("failed in own_optimum: malformed message 'result': expected a number 'standard_error'"));
}

TEST_F(ProcessSceneTest, PassesRequestsAndAnswersOfAStation) {
  const auto scene = station();
  EXPECT_TRUE(scene->offers_stage());
  EXPECT_EQ(Json::parse(scene->describe())["name"], "raw");
  const relign_image reference = scene->reference();
  EXPECT_EQ(reference.width, 3u);
  EXPECT_EQ(reference.height, 2u);
  EXPECT_THAT(std::vector<float>(reference.pixels, reference.pixels + 6), ElementsAre(0, 1, 2, 3, 4, 5));
  scene->begin(~std::uint64_t{0});
  const Scene::StageMove made = scene->move_by({0.5, 1});
  EXPECT_THAT(made.moved, ElementsAre(0.5, -0.25));
  EXPECT_EQ(made.limits_low, 2u);
  EXPECT_EQ(made.limits_high, 1u);
  EXPECT_EQ(made.machine_seconds, 0.125);
  std::vector<float> pixels(6);
  EXPECT_EQ(scene->capture(pixels.data()), 1.5);
  EXPECT_THAT(pixels, Each(0.5f));
  EXPECT_EQ(scene->reference().pixels[5], 5.0f) << "the reference is unchanged";
}

TEST_F(ProcessSceneTest, PassesNumbersAndSeedsExactly) {
  const auto scene = station(R"(
def answer_begin(asked): assert asked["seed"] == 2**64 - 1; return '{"message":"ok"}'
def answer_move_by(asked):
    assert asked["delta"] == [1/3, -5e-324], asked
    return json.dumps({"message": "moved", "moved": asked["delta"], "limits_low": 0, "limits_high": 0, "machine_seconds": 0.1})
)");
  scene->begin(~std::uint64_t{0});
  const std::vector<double> delta = {1.0 / 3, -std::numeric_limits<double>::denorm_min()};
  EXPECT_EQ(scene->move_by(delta).moved, delta);
}

TEST_F(ProcessSceneTest, RejectsInvalidAnswersWithTheMessagesOfLibraries) {
  const auto moved = [](const std::string& members) {
    return "def answer_move_by(asked): return '{\"message\":\"moved\"," + members + "}'";
  };
  EXPECT_THAT(failure(moved(R"("moved":[0,0],"limits_low":0,"limits_high":0,"machine_seconds":null)")),
              AllOf(HasSubstr("plugin 'raw' failed in move_by: machine_seconds is nan; expected a finite number"),
                    HasSubstr("; its process")));
  EXPECT_THAT(failure(moved(R"("moved":[0,0],"limits_low":4,"limits_high":0,"machine_seconds":0)")),
              HasSubstr("limit flags exceed its 2 axes"));
  EXPECT_THAT(failure(moved(R"("moved":[0,null],"limits_low":0,"limits_high":0,"machine_seconds":0)")),
              HasSubstr("the reported move of axis 1 is nan; expected a fraction of the travel"));
  EXPECT_THAT(failure(moved(R"("moved":[0],"limits_low":0,"limits_high":0,"machine_seconds":0)")),
              HasSubstr("it moved 1 axes; expected 2"));
  EXPECT_THAT(failure(moved(R"("moved":[0,0],"limits_low":-1,"limits_high":0,"machine_seconds":0)")),
              HasSubstr("malformed message 'moved': expected an integer from 0 to 2^64 - 1 'limits_low'"));
  EXPECT_THAT(failure("def answer_capture(asked): write([0] * 6); return '{\"message\":\"captured\"}'"),
              HasSubstr("malformed message 'captured': expected a number 'machine_seconds'"));
  EXPECT_THAT(
      failure(
          "def answer_capture(asked): write([0] * 6); return '{\"message\":\"captured\",\"machine_seconds\":null}'"),
      HasSubstr("machine_seconds is nan"));
  EXPECT_THAT(failure("def answer_describe(asked): return '{\"message\":\"described\",\"description\":[]}'"),
              HasSubstr("failed in describe: malformed message 'described': expected an object 'description'"));
}

TEST_F(ProcessSceneTest, RejectsIncompleteImages) {
  const char* few =
      "def answer_capture(asked): write([0] * 5); return '{\"message\":\"captured\",\"machine_seconds\":0}'";
  EXPECT_THAT(failure(few),
              HasSubstr("failed in capture: its image file has 20 bytes; expected 24: 2 rows of 3 float32"));
  EXPECT_THAT(failure("def answer_reference(asked): write([0] * 7); return '{\"message\":\"ok\"}'"),
              HasSubstr("failed in reference: its image file has 28 bytes; expected 24"));
  // The image of the previous request does not count.
  EXPECT_THAT(failure("def answer_capture(asked): return '{\"message\":\"captured\",\"machine_seconds\":0}'"),
              HasSubstr("its image file has 0 bytes"));
  EXPECT_THAT(failure("def answer_describe(asked): return '{\"message\":\"described\",\"description\":"
                      "{\"image\":{\"width\":1e9,\"height\":1e9}}}'"),
              HasSubstr("its description has no image size"));
}

TEST_F(ProcessSceneTest, ReportsCrashesAndMalformedMessages) {
  EXPECT_THAT(failure("def answer_capture(asked): print('the laser is off', flush=True); os.kill(os.getpid(), 6)"),
              AllOf(HasSubstr("failed in capture"), HasSubstr("killed by SIGABRT"), HasSubstr("\n  the laser is off")));
  EXPECT_THAT(failure("def answer_move_by(asked): say('{\"message\":\"mov'); os._exit(3)"),
              AllOf(HasSubstr("failed in move_by"), HasSubstr("in the middle of a message"), HasSubstr("status 3")));
  EXPECT_THAT(failure("def answer_begin(asked): return '{\"message\":\"failed\",\"text\":\"no air pressure\"}'"),
              HasSubstr("failed in begin: no air pressure"));
  EXPECT_THAT(failure("def answer_capture(asked): return '{\"message\":\"ok\"}'"),
              HasSubstr("expected the message 'captured', found '{\"message\":\"ok\"}'"));
  EXPECT_THAT(failure("def answer_begin(asked): return '[' * 100000 + ']' * 100000"), HasSubstr("nested too deep"));
}

TEST_F(ProcessSceneTest, KillsAndNamesHangingProcess) {
  ::setenv("RELIGN_CALL_SECONDS", "0.5", 1);
  EXPECT_THAT(failure("def answer_capture(asked): time.sleep(100)"),
              AllOf(HasSubstr("failed in capture: it did not answer within 0.5 s"), HasSubstr("was killed")));
}

TEST_F(ProcessSceneTest, RepeatsTheFailureForLaterRequests) {
  const auto scene =
      station("def answer_begin(asked): return '{\"message\":\"failed\",\"text\":\"no air pressure\"}'\n");
  const std::string first = test::error_text(ErrorKind::plugin_failed, [&] { scene->begin(1); });
  std::vector<float> pixels(6);
  EXPECT_EQ(test::error_text(ErrorKind::plugin_failed, [&] { scene->capture(pixels.data()); }), first);
}

TEST_F(ProcessSceneTest, AcceptsAnyAmountOfOutput) {
  const auto scene = station(R"(
def answer_capture(asked):
    for i in range(20000): print("x" * 50)
    os.write(1, b'{"message":"failed"}\n')
    write([1] * 6)
    return '{"message":"captured","machine_seconds":0}'
)");
  std::vector<float> pixels(6);
  scene->capture(pixels.data());
  EXPECT_THAT(pixels, Each(1.0f));
  EXPECT_EQ(logged_.size(), 20001u) << "all output is passed on; its receiver limits it";
}

TEST_F(ProcessSceneTest, RejectsDrawThatIsNotAnObject) {
  const char* draws_seven = "greet(); hear(); say('{\"message\":\"drawn\",\"drawn\":7}\\n'); hear()";
  NoiseLevel odd(choice(Kind::noise_level, raw(draws_seven, "noise-level")), services_);
  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed, [&] { odd.draw(1, "{}"); }),
              HasSubstr("malformed message 'drawn': expected an object 'drawn'"));
}

}  // namespace
}  // namespace relign::plugin_host
