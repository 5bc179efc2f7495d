// The classes of relign_bench.plugin for scenes, stations and noise levels, called by the host.
#include <gmock/gmock.h>

#include <cmath>

#include "base/json_source.h"
#include "process_folder.h"

namespace relign::plugin_host {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

class ProcessPythonTest : public test::ProcessFolderTest {
 protected:
  // A class of relign_bench with these members.
  fs::path script(const std::string& base, const std::string& members) {
    return write("made.py",
                 "\"\"\"Does what the test wants.\"\"\"\nimport array, os, sys\n"
                 "from relign_bench.plugin import *\nclass Made(" +
                     base + "):\n" + indented(members, 4) + "if __name__ == '__main__': serve(Made)\n");
  }
  // A station with additional or replaced members.
  fs::path python_station(const std::string& members) {
    return script("Station", R"py(def describe(self):
    return {"name": "made", "axes": [], "image": {"width": 3, "height": 2, "white": 1}}
def reference(self): return [[0, 1, 2], [3, 4, 5]]
def begin(self, seed): print("begin", seed)
def move_by(self, delta): return Moved(delta, 0.25)
def capture(self): return [[0.5] * 3] * 2, 0.5
)py" + members);
  }
  std::string python_failure(const std::string& members) {
    return test::error_text(ErrorKind::plugin_failed, [&] {
      Scene scene(choice(Kind::scene, python_station(members)), services_);
      std::vector<float> pixels(6);
      scene.begin(1);
      scene.move_by({0.5, -0.25});
      scene.capture(pixels.data());
    });
  }
};

TEST_F(ProcessPythonTest, RunsAStationInPython) {
  Scene scene(choice(Kind::scene, python_station(R"(def move_by(self, delta):
    return Moved([delta[0], 0], 0.25, (0, +1))
def capture(self): return array.array("f", [0.5] * 6), 0.5)")),
              services_);
  const Json description = Json::parse(scene.describe());
  EXPECT_EQ(description["owns_stage"], true);
  EXPECT_EQ(description["truth"], false);
  EXPECT_EQ(scene.reference().pixels[4], 4.0f);
  scene.begin(7);
  const Scene::StageMove made = scene.move_by({0.125, 0.5});
  EXPECT_THAT(made.moved, ElementsAre(0.125, 0));
  EXPECT_EQ(made.limits_low, 0u);
  EXPECT_EQ(made.limits_high, 2u);
  std::vector<float> pixels(6);
  EXPECT_EQ(scene.capture(pixels.data()), 0.5);
  EXPECT_THAT(logged_, Contains("begin 7"));
}

// Many invalid answers in one process: begin passes them to the class that sends messages, and prints its errors.
const char* const kWrongAnswers = R"py(
def capture(self): return self.wrong
def move_by(self, delta): return self.wrong
def begin(self, seed):
    from relign_bench.plugin.handlers import StationHandler
    asked = StationHandler(self)
    asked.on_describe({"image_file": "/dev/null"})
    for request, message, wrongs in self.cases():
        for self.wrong in wrongs:
            try: getattr(asked, request)(message)
            except (TypeError, ValueError) as error: print(error)
            else: print("accepted", self.wrong)
    self.wrong = None
)py";

TEST_F(ProcessPythonTest, ReportsWrongShapesAndTypes) {
  const fs::path file = python_station(kWrongAnswers + std::string(R"py(
def cases(self):
    few = ([[0] * 3], [[0] * 3, [0]], [[0] * 3, "abc"], bytes(20), array.array("d", [0] * 3), None)
    yield "on_capture", {}, [(pixels, 0.5) for pixels in few]
    yield "on_capture", {}, [bytes(24), (bytes(24), float("nan")), (bytes(24), -1), (bytes(24), "1 s")]
    moved = [(0, 0), Moved([0], 0), Moved([0, None], 0), Moved([0, 0], 0, (2, 0)), Moved([0, 0], 0, (1,))]
    yield "on_move_by", {"delta": [0, 0]}, moved
)py"));
  Scene(choice(Kind::scene, file), services_).begin(1);
  EXPECT_THAT(logged_, ElementsAre("capture() returned 1 rows, expected 2 rows of 3 pixels",
                                   "row 1 of capture() has 1 pixels, expected 2 rows of 3 pixels",
                                   "row 1 of capture() is not a list of numbers, expected 2 rows of 3 pixels",
                                   "capture() returned 20 bytes, expected 2 rows of 3 pixels: 24 bytes of float32",
                                   "capture() returned values of the format 'd', expected float32 ('f')",
                                   "capture() returned NoneType, expected 2 rows of 3 pixels",
                                   "capture() returned bytes, expected two values (pixels, machine_seconds)",
                                   "machine_seconds of capture() is nan, expected a finite number",
                                   "machine_seconds of capture() is -1.0, expected a non-negative number",
                                   "machine_seconds of capture() is '1 s', expected a number",
                                   "move_by() returned tuple, expected Moved(moved, machine_seconds)",
                                   "moved has 1 values, expected one per axis (2)",
                                   "a value of moved is None, expected a number",
                                   "limits must be -1 (lower), 0 or +1 (upper) per axis, found (2, 0)",
                                   "limits has 1 values, expected one per axis (2)"));
}

TEST_F(ProcessPythonTest, ReportsExceptionsOfThePluginWithLine) {
  EXPECT_THAT(python_failure("def begin(self, seed): 1 / 0"),
              AllOf(HasSubstr("failed in begin: ZeroDivisionError"), HasSubstr("(made.py, line ")));
  EXPECT_THAT(python_failure("begin = Station.begin"), HasSubstr("Made has no begin(self, seed)"));
}

TEST_F(ProcessPythonTest, AcceptsNumpyArraysAsPixels) {
  if (!runs("python3 -c 'import numpy'")) GTEST_SKIP() << "numpy is not installed";
  Scene scene(choice(Kind::scene, python_station(kWrongAnswers + std::string(R"py(
import numpy
def cases(self):
    yield "on_capture", {}, [(self.numpy.zeros((2, 3, 1)), 0), (self.numpy.full((2, 3), "a"), 0)]
def capture(self):
    if self.wrong: return self.wrong
    return self.numpy.arange(6).reshape(3, 2).T / 4, self.numpy.float32(0.5)
)py"))),
              services_);
  scene.begin(1);
  EXPECT_THAT(logged_, ElementsAre("capture() returned an array of shape (2, 3, 1), expected 2 rows of 3 pixels",
                                   "capture() returned an array of <U1, expected 2 rows of 3 pixels"));
  std::vector<float> pixels(6);
  EXPECT_EQ(scene.capture(pixels.data()), 0.5);
  EXPECT_THAT(pixels, ElementsAre(0, 0.5f, 1, 0.25f, 0.75f, 1.25f)) << "rows, for any memory order of the array";
}

TEST_F(ProcessPythonTest, MountsAndReleasesLenses) {
  const fs::path file = script("Scene", R"py(picture = parameter(True)
def describe(self): return {"name": "made", "axes": [], "image": {"width": 3, "height": 2}, "elements": ["L1"]}
def reference(self): return bytes(24)
def mount(self, offsets):
    if offsets and "L1" not in offsets: raise ValueError("no element " + list(offsets)[0])
    lens = self.Lens()
    lens.offsets = offsets
    if self.picture: lens.render_noise_free = lambda pose: [[7] * 3] * 2
    if self.picture: lens.mtf = lambda pose, lp_per_mm: (pose[1] / lp_per_mm, pose[0])
    return lens
class Lens(Assembly):
    def __del__(self): print("unmounted", self.offsets)
    def capture(self, true_pose, frame_seed):
        print("at", true_pose)
        return [[frame_seed] * 3, [self.offsets["L1"]["shift_mm"][2]] * 3]
    def noise_free_mse(self, true_pose, seed): return true_pose[0], seed)py");
  Scene scene(choice(Kind::scene, file), services_);
  EXPECT_FALSE(scene.offers_stage());
  std::vector<float> pixels(6);
  {
    MountedAssembly lens = scene.mount(R"({"L1": {"shift_mm": [0, 0, 0.25], "tilt_deg": [0, 0]}})");
    MountedAssembly other = scene.mount(R"({"L1": {"shift_mm": [0, 0, 0.5], "tilt_deg": [0, 0]}})");
    lens.capture({0.5, std::nan("")}, 3, pixels.data());
    EXPECT_THAT(pixels, ElementsAre(3, 3, 3, 0.25f, 0.25f, 0.25f));
    other.capture({1, 2}, 4, pixels.data());
    EXPECT_EQ(pixels[5], 0.5f);
    const MountedAssembly::Truth truth = lens.noise_free_mse({-1e-9, 0}, 2);
    EXPECT_EQ(truth.mse, -1e-9);
    EXPECT_EQ(truth.standard_error, 2);
    EXPECT_TRUE(other.render_noise_free({0.5, 0.5}, pixels.data()));
    EXPECT_THAT(pixels, Each(7.0f));
    const auto mtf = other.mtf({0.25, 0.5}, 20);
    ASSERT_TRUE(mtf);
    EXPECT_EQ(mtf->centre, 0.025);
    EXPECT_EQ(mtf->corner, 0.25);
  }
  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed, [&] { scene.mount(R"({"L9": {"shift_mm": [0, 0, 0]}})"); }),
              HasSubstr("failed in mount: ValueError: no element L9"));
  EXPECT_THAT(logged_, AllOf(Contains("at (0.5, nan)"), Contains("at (1.0, 2.0)"),
                             Contains(HasSubstr("unmounted {'L1': {'shift_mm': [0.0, 0.0, 0.25]"))));

  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed,
                               [&] {
                                 Scene(choice(Kind::scene, file), services_).mount("{}").mtf({1.5, 0.5}, 20);
                               }),
              HasSubstr("failed in mtf: 'corner' is 1.5; expected 0 to 1"));

  Scene plain(choice(Kind::scene, file, {{"picture", false}}), services_);
  EXPECT_FALSE(plain.mount("{}").render_noise_free({0.5, 0.5}, pixels.data()));
  EXPECT_FALSE(plain.mount("{}").mtf({0.5, 0.5}, 20));
}

TEST_F(ProcessPythonTest, PassesResultsOfAbilities) {
  const fs::path file = script("Scene", R"py(wrong = parameter(False)
def describe(self): return {"name": "made", "axes": [1, 2], "image": {"width": 3, "height": 2}, "elements": []}
def reference(self): return bytes(24)
def mount(self, offsets):
    lens = self.Lens()
    lens.wrong = self.wrong
    return lens
class Lens(Assembly):
    def capture(self, true_pose, frame_seed): return bytes(24)
    def noise_free_mse(self, true_pose, seed): return 0, 0
    def render_average(self, pose, seed, error, samples): return [[pose[0]] * 3] * 2, error, samples + seed
    def own_optimum(self, seed): return (0.25, 0.5)[:1 if self.wrong else 2], -1e-3, seed / 8
    def fields(self, pose, lp_per_mm, which):
        if self.wrong: return [(0, 0, 0)] * len(which)
        return [(i, float("nan"), 0.5, lp_per_mm / 100) for i in which]
    def mtf(self, pose, lp_per_mm): return None)py");
  Scene scene(choice(Kind::scene, file), services_);
  MountedAssembly lens = scene.mount("{}");
  std::vector<float> pixels(6);
  const auto average = lens.render_average({0.5, 0}, 3, 0.25, std::uint64_t{1} << 60, pixels.data());
  ASSERT_TRUE(average);
  EXPECT_THAT(pixels, Each(0.5f));
  EXPECT_EQ(average->standard_error, 0.25);
  EXPECT_EQ(average->samples_used, (std::uint64_t{1} << 60) + 3);
  const auto optimum = lens.own_optimum(2);
  ASSERT_TRUE(optimum);
  EXPECT_THAT(optimum->true_pose, ElementsAre(0.25, 0.5));
  EXPECT_EQ(optimum->mse, -1e-3);
  EXPECT_EQ(optimum->standard_error, 0.25);
  const auto fields = lens.fields({0.5, 0}, 75, {2, 0});
  ASSERT_EQ(fields.size(), 2u);
  EXPECT_EQ(fields[0].x_px, 2);
  EXPECT_TRUE(std::isnan(fields[1].y_px));
  EXPECT_EQ(fields[1].sagittal, 0.75);
  EXPECT_FALSE(lens.mtf({0.5, 0}, 20)) << "it returned None";
  EXPECT_FALSE(lens.render_noise_free({0.5, 0}, pixels.data())) << "it has no such method";

  const auto failure = [&](auto&& call) {
    Scene wrong(choice(Kind::scene, file, {{"wrong", true}}), services_);
    MountedAssembly other = wrong.mount("{}");
    return test::error_text(ErrorKind::plugin_failed, [&] { call(other); });
  };
  EXPECT_THAT(failure([](MountedAssembly& other) { other.own_optimum(2); }),
              HasSubstr("failed in own_optimum: 'true_pose' has 1 values; expected 2"));
  EXPECT_THAT(failure([](MountedAssembly& other) {
                other.fields({0, 0}, 75, {1});
              }),
              HasSubstr("fields() returned tuple of 3, expected four values (x_px, y_px, tangential, sagittal)"));
}

TEST_F(ProcessPythonTest, CapturesRegions) {
  const fs::path file = script("Scene", R"py(able = parameter(True)
@property
def captures_regions(self): return self.able
def describe(self): return {"name": "made", "axes": [], "image": {"width": 3, "height": 2}, "elements": []}
def reference(self): return bytes(24)
def mount(self, offsets): return self.Lens()
class Lens(Assembly):
    def capture(self, true_pose, frame_seed): return [[1, 2, 3], [4, 5, 6]]
    def capture_regions(self, true_pose, frame_seed, regions):
        print("regions", true_pose, frame_seed, regions)
        return self.capture(true_pose, frame_seed), frame_seed / 8
    def noise_free_mse(self, true_pose, seed): return 0, 0)py");
  Scene scene(choice(Kind::scene, file), services_);
  MountedAssembly lens = scene.mount("{}");
  ASSERT_TRUE(lens.captures_regions());
  std::vector<float> pixels(6);
  EXPECT_EQ(lens.capture_regions({0.5}, 2, {{1, 0, 2, 1}, {0, 1, 1, 1}}, pixels.data()), 0.25);
  EXPECT_EQ(pixels[2], 3);
  EXPECT_THAT(logged_, Contains("regions (0.5,) 2 [(1, 0, 2, 1), (0, 1, 1, 1)]"));
  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed,
                               [&] {
                                 lens.capture_regions({0.5}, 9, {{1, 0, 2, 1}}, pixels.data());
                               }),
              HasSubstr("failed in capture_regions: 'share' is 1.125; expected 0 to 1"));
  Scene unable(choice(Kind::scene, file, {{"able", false}}), services_);
  EXPECT_FALSE(unable.mount("{}").captures_regions());
}

TEST_F(ProcessPythonTest, DrawsFromANoiseLevel) {
  const fs::path file = script("NoiseLevel", R"(def draw(self, seed, scene):
    if seed == 1: return [seed]
    return {"start": [seed / 3, len(scene["axes"])], "distortion": [], "elements": {}})");
  NoiseLevel level(choice(Kind::noise_level, file), services_);
  const Json drawn = Json::parse(level.draw(2, "{\"axes\":\n [1, 2]}"));
  EXPECT_EQ(drawn["start"], Json::array({2.0 / 3, 2}));
  EXPECT_THAT(test::error_text(ErrorKind::plugin_failed, [&] { level.draw(1, R"({"axes": []})"); }),
              HasSubstr("plugin 'made' failed in draw: TypeError: draw() returned list, expected a dictionary"));
}

}  // namespace
}  // namespace relign::plugin_host
