// The services of a trial over messages: a Python algorithm gets the answers that a library gets, and each runs the
// other as inner algorithm. Fake scene and words of the log as in services_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "plugin_host/confinement.h"
#include "plugin_host/test_folder.h"
#include "trials/fakes.h"
#include "trials/pretraining.h"

namespace relign::trials::process_services {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

const char* const kLibrary = "service_user";
const char* const kPython = "service_user_python/service_user.py";

struct ServiceTrial : TrialWithServices {
  ServiceTrial(const std::string& plugin, const Json& parameters, const Json& scene_parameters = Json::object())
      : TrialWithServices(plugin, parameters, scene_parameters) {}
  std::string refusal(std::size_t which) const { return answer("refused", which).get<std::string>(); }
};

void expect_equal(const TrialResult& one, const TrialResult& two) {
  EXPECT_EQ(one.end, two.end) << one.message << two.message;
  ASSERT_EQ(one.steps.size(), two.steps.size());
  for (std::size_t k = 0; k < one.steps.size(); ++k) {
    EXPECT_EQ(one.steps[k].commanded_pose, two.steps[k].commanded_pose) << k;
    EXPECT_EQ(one.steps[k].true_pose, two.steps[k].true_pose) << k;
    EXPECT_EQ(one.steps[k].merit, two.steps[k].merit) << k;
    EXPECT_EQ(one.steps[k].regions, two.steps[k].regions) << k;
    EXPECT_EQ(one.steps[k].recommended_pose, two.steps[k].recommended_pose) << k;
    EXPECT_EQ(one.steps[k].recommended_mse, two.steps[k].recommended_mse) << k;
  }
}

class ProcessServices : public test::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    if (std::system("python3 -c 'import sys; sys.exit(sys.version_info < (3, 9))' >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "python3 (3.9 or later) is not installed";
  }
  // A Python plugin with this body of run(self, trial).
  std::string python(const std::string& body, const std::string& observes = R"("images", "merit", "design")",
                     const std::string& prepare = "None") {
    std::string text =
        "\"\"\"Tries what the test wants.\"\"\"\nimport json, os\n"
        "from relign_bench.plugin import Optimizer, parameter, serve\nclass Guess(Optimizer):\n    observes = (" +
        observes + ",)\n    prepare = " + prepare + "\n    then = parameter(\"" +
        std::string(RELIGN_TASK_TEST_PLUGINS) + "/fake_optimizer\", type=\"algorithm\")\n    def run(self, trial):\n";
    std::istringstream lines(body);
    for (std::string line; std::getline(lines, line);) text += "        " + line + "\n";
    return write("guess.py", text + "if __name__ == '__main__': serve(Guess)\n");
  }
};

TEST_F(ProcessServices, MatchTheLibraryAnswers) {
  const Json script = Json::parse(R"([["reference"], ["measure", "mean"], ["measure", "contrast"], ["list"],
      ["fields", {"cycles_per_pixel": 0.1}],
      ["measure", "mtf", {"cycles_per_pixel": 0.1}], ["draw", 7], ["draw", 8], ["history"],
      ["select", [[1, 0, 2, 1], [0, 1, 1, 1]]], ["select", [[1, 0, 2, 1]]],
      ["model", {}, [0.5, 0.5, 0.5], 18446744073709551615],
      ["model", {"L1": {"shift_mm": [0.1, 0, 0]}}, [0.1234567890123, 0.5, 0.5], 1],
      ["lens", [0.5, 0.5, 0.75], 3, "mean", {"lp_per_mm": 50}],
      ["slopes", [0.25, 0.5, 0.75], 3, 4, [1, 0]], ["slopes", [0.25, 0.5, 0.75], 3, 4, []], ["keep_lens"],
      ["step", [0.4, 0.58, 0.5]], ["measure", "mean"],
      ["run", "then", 3, {"script": [["first"], ["step", 0.42, 0.58, 0.5], ["recommend", 0.1, 0.2, 0.3],
                                     ["step", 0.5, 0.5, 0.5], ["step", 0.6, 0.58, 0.5], ["step", 0.6, 0.58, 0.5]]}],
      ["measure", "mean"], ["recommend", [0.5, 0.5, 0.5]],
      ["run", "then", 10, {"script": [["move", 0.01, 0, 0]]}], ["run", "then", 10],
      ["run", "then", 10], ["step", [0.5, 0.5, 0.5]]])");
  ServiceTrial library(kLibrary, {{"script", script}}, {{"noise", 0.05}, {"regions", true}});
  ServiceTrial python(kPython, {{"script", script}}, {{"noise", 0.05}, {"regions", true}});
  // The same library in a process of its own.
  ServiceTrial sandboxed(kLibrary, {{"script", script}}, {{"noise", 0.05}, {"regions", true}});
  sandboxed.algorithm_services.sandbox = std::make_shared<plugin_host::Sandbox>();
  std::vector<ServiceTrial*> processes = {&python};
  if (plugin_host::sandbox_problem().empty()) processes.push_back(&sandboxed);
  for (ServiceTrial* trial : {&library, &python, &sandboxed}) {
    trial->terms.budget = 5;
    trial->level = std::make_unique<plugin_host::NoiseLevel>(
        fake(plugin_host::Kind::noise_level, "fake_level", {{"batches", true}}), trial->services);
    trial->instance.perturbations.batch = ModuleBatch{5, {0, 0.01, 0}, {0.001, 0.001, 0}};
    trial->facts.pitch_um = 5;
    trial->facts.fields = {{"left", images::Mark{1, 1, 16}, images::Region{0, 0, 1, 2}, {}},
                           {"right", {}, {}, images::Region{2, 0, 1, 2}}};
  }
  const TrialResult in_library = library.run();
  for (ServiceTrial* trial : processes) expect_equal(in_library, trial->run());
  EXPECT_THAT(in_library.steps, SizeIs(6));
  EXPECT_EQ(in_library.steps[1].regions, (PixelRegions{{1, 0, 2, 1}})) << "the last selection";
  EXPECT_THAT(library.logged("refused"), IsEmpty());
  EXPECT_THAT(library.logged("run"), SizeIs(4));
  EXPECT_THAT(library.logged("model"), SizeIs(2));
  ASSERT_THAT(library.answer("lens"), SizeIs(2));
  EXPECT_THAT(library.answer("lens")[1], SizeIs(2)) << "a row for each field";
  ASSERT_THAT(library.answer("slopes"), SizeIs(1 + 3 + 2 * 5));
  EXPECT_EQ(library.answer("slopes")[3], Json({0.75, 4.75}));
  EXPECT_EQ(library.answer("slopes")[4], Json({20, 24})) << "the second element first, as asked";
  EXPECT_THAT(library.answer("history"), SizeIs(3));
  for (const ServiceTrial* trial : processes)
    EXPECT_EQ(library.logged(), trial->logged()) << (trial == &python ? "in Python" : "in a sandbox");
}

TEST_F(ProcessServices, RejectWithTheSameMessages) {
  const Json script = Json::parse(R"([["measure", "sharpnes"], ["model", {"L9": {}}, [0.5, 0.5, 0.5], 1],
      ["select", [[0, 0, 4, 1]]], ["select", [[0, 0, -1, 1]]],
      ["model", {}, [0.5, 0.5, 0.5], -1], ["model", [1], [0.5, 0.5, 0.5], 1],
      ["slopes", [0.5, 0.5, 0.5], 1, 0, []], ["slopes", [0.5, 0.5, 0.5], 1, 1, [2]],
      ["slopes", [0.5, 0.5, 0.5], 1, 1, [0, 0]], ["slopes", [0.5, 0.5, 0.5], 1, 1, [-1]],
      ["slopes", [0.5, 0.5], 1, 1, []], ["lens", [0.5, 0.5, 0.5], -1, "mean", {}],
      ["lens", [0.5, 0.5, 0.5], 1, "menu", {}], ["run", "than", 1], ["run", "then", 0], ["run", "then", 1, {"scrpt": []}], ["run", "then", -1],
      ["run", "then", 2, {"script": [["step", 0.5, 0.5, 0.5], ["fail"]]}], ["step", [0.6, 0.5, 0.5]]])");
  ServiceTrial trial(kPython, {{"script", script}});
  const TrialResult result = trial.run();
  EXPECT_EQ(result.end, End::finished) << result.message;
  EXPECT_THAT(result.steps, SizeIs(3));
  const char* const words[] = {"'sharpness'",
                               "no element 'L9'",
                               "3 columns",
                               "non-negative integers",
                               "integer 'seed'",
                               "object",
                               "1 sample",
                               "numbers below 2",
                               "different elements",
                               "'elements'",
                               "3 values",
                               "no image was made",
                               "'mean'",
                               "'then'",
                               "at least 1 step",
                               "no parameter 'scrpt'",
                               "integer 'steps'",
                               "out of ideas"};
  ASSERT_THAT(trial.logged("refused"), SizeIs(std::size(words)));
  for (std::size_t i = 0; i < std::size(words); ++i) EXPECT_THAT(trial.refusal(i), HasSubstr(words[i]));
}

TEST_F(ProcessServices, RunsInnerAlgorithmsInEitherLanguage) {
  const Json inner_script =
      Json::parse(R"([["reference"], ["measure", "mean"], ["step", [0.45, 0.5, 0.5]], ["recommend", [0.5, 0.4, 0.5]],
                      ["model", {}, [0.5, 0.5, 0.5], 3], ["step", [0.55, 0.5, 0.5]], ["step", [0.65, 0.5, 0.5]]])");
  const auto trial_of = [&](const char* outer, const char* inner) {
    const Json use = {{"use", (fs::path(RELIGN_TASK_TEST_PLUGINS) / inner).string()},
                      {"parameters", {{"script", inner_script}}}};
    return ServiceTrial(
        outer, {{"script", Json::parse(R"([["run", "then", 2], ["measure", "mean"], ["step", [0.5, 0.6, 0.5]]])")},
                {"then", use}});
  };
  ServiceTrial libraries = trial_of(kLibrary, kLibrary);
  const TrialResult expected = libraries.run();
  ASSERT_THAT(expected.steps, SizeIs(4));
  ASSERT_THAT(libraries.logged("run"), SizeIs(1));
  for (const auto& [outer, inner] : {std::pair{kLibrary, kPython}, {kPython, kLibrary}, {kPython, kPython}}) {
    ServiceTrial trial = trial_of(outer, inner);
    expect_equal(expected, trial.run());
    EXPECT_EQ(libraries.logged(), trial.logged()) << outer << " to " << inner;
  }
}

TEST_F(ProcessServices, ReportsDeathOfInnerProcessToTheCaller) {
  const std::string dies = python("trial.step([0.5, 0.5, 0.5])\nos._exit(7)", R"("merit", "start")");
  ServiceTrial trial(kLibrary,
                     {{"script", Json::parse(R"([["run", "then", 2], ["step", [0.6, 0.5, 0.5]]])")}, {"then", dies}});
  const TrialResult result = trial.run();
  EXPECT_EQ(result.end, End::finished);
  EXPECT_THAT(result.steps, SizeIs(3));
  EXPECT_THAT(trial.refusal(0), AllOf(HasSubstr("plugin 'guess' failed in run"), HasSubstr("exit status 7")));
}

TEST_F(ProcessServices, ServesOnlyTheImagesOfTheCurrentStep) {
  ServiceTrial trial(python(R"py(before = trial.first
mean = lambda image: float(image[1, 2])
half = trial.run("then", 2, script=[["move", 0.1, 0, 0], ["move", 0.1, 0, 0]])
assert abs(mean(half.last.image) - trial.measures().measure("mean")) < 1e-6
assert half.best.step == 2 and mean(half.best.image) == mean(half.last.image)
try: before.image
except RuntimeError as error: print("gone", json.dumps(str(error)))
try: trial.run("then", 2, script=[["move", -0.2, 0, 0], ["fail"]])
except RuntimeError as error: print("failed", json.dumps(str(error)))
else: assert False
half.last.image  # looked at before: kept
after = trial.step([0, 0.1, 0])
assert after.step == 4, after)py"),
                     Json::object());
  const TrialResult result = trial.run();
  EXPECT_EQ(result.message, "");
  EXPECT_THAT(result.steps, SizeIs(5));
  ASSERT_THAT(trial.logged("gone"), SizeIs(1));
  EXPECT_THAT(trial.logged("gone")[0].get<std::string>(),
              HasSubstr("the pixels of step 0 are gone (the current step is 2)"));
  ASSERT_THAT(trial.logged("failed"), SizeIs(1));
}

TEST_F(ProcessServices, ModelHasItsOwnPixelBuffer) {
  const std::string body = R"py(model = trial.model()
assert model is trial.model()
assert (model.width, model.height) == (3, 2) and model.scene["elements"] == ["L1", "L2"]
lens = model.mount({"L1": {"shift_mm": [0.1, 0, 0]}})
image = lens.capture([0.5, 0.5, 0.5], 1)
assert image.shape == (2, 3) and all(abs(float(image[y, x]) - 0.6) < 1e-6 for y in range(2) for x in range(3))
assert lens.noise_free([0.5, 0.5, 0.5]) is None
for bad in ([0.5], [0.5, 0.5, float("nan")]):
    try: lens.capture(bad, 1)
    except ValueError as error: print("refused", json.dumps(str(error)))
    else: assert False
others = [model.mount() for _ in range(15)]
try: model.mount()
except ValueError as error: print("refused", json.dumps(str(error)))
else: assert False
lens.unmount(); lens.unmount()
others.append(model.mount())
try: lens.capture([0.5, 0.5, 0.5], 1)
except ValueError as error: print("refused", json.dumps(str(error)))
else: assert False
assert float(image[0, 0]) > 0.59, "arrays survive later captures")py";
  ServiceTrial alone(python(body, R"("design")"), Json::object());
  EXPECT_EQ(alone.run().message, "");
  ASSERT_THAT(alone.logged("refused"), SizeIs(4));
  EXPECT_THAT(alone.refusal(2), HasSubstr("16 lenses"));
  EXPECT_THAT(alone.refusal(3), HasSubstr("no longer mounted"));
  ServiceTrial with_images(python("seen = trial.first\nwanted = trial.reference\n" + body +
                                  "\nassert abs(float(seen.image[0, 0]) - trial.measures().measure('mean')) < 1e-6\n"
                                  "assert float(wanted[0, 0]) == 0.5"),
                           Json::object());
  EXPECT_EQ(with_images.run().message, "");
}

// The host checks messages that a process sends by itself, and the data do not overwrite images or model pixels.
TEST_F(ProcessServices, PreparedDataHaveTheirOwnBuffer) {
  const std::string body = R"py(seen, wanted, prepared = trial.first, trial.reference, trial.pretraining()
lens = trial.model().mount()
before = float(lens.capture([0.5, 0.5, 0.5], 1)[0, 0])
def ask(call, **arguments):
    try: return trial._service("relign.prepared/1", call, **arguments)
    except ValueError as error: print("refused", json.dumps(str(error)))
ask("save", data=5)
ask("room", bytes=(1 << 30) + 1)
ask("room", bytes=-1)
ask("room")
prepared.save(bytes(range(256)) * 1000)
assert prepared.load() == bytes(range(256)) * 1000
assert float(seen.image[0, 0]) == float(trial.first.image[0, 0]) and float(trial.reference[0, 0]) == 0.5
assert float(lens.capture([0.5, 0.5, 0.5], 1)[0, 0]) == before
assert prepared.load() == bytes(range(256)) * 1000
ask("save", data=256001)
prepared.save(memoryview(b""))
assert prepared.load() == b""
prepared.save(b"last"))py";
  ServiceTrial trial(python(body, R"("images", "design")", R"({"sources": 3, "steps": 4})"), Json::object());
  PretrainingState state;
  state.sources = 3;
  trial.pretraining = &state;
  EXPECT_EQ(trial.run().message, "");
  ASSERT_THAT(trial.logged("refused"), SizeIs(5));
  EXPECT_THAT(trial.refusal(0), HasSubstr("request 'room' first"));
  EXPECT_THAT(trial.refusal(1), HasSubstr("at most 1 GiB"));
  EXPECT_THAT(trial.refusal(2), HasSubstr("integer 'bytes'"));
  EXPECT_THAT(trial.refusal(4), HasSubstr("request 'room' first"));
  ASSERT_TRUE(state.bytes);
  EXPECT_EQ(*state.bytes, "last");
}

TEST_F(ProcessServices, NamesMissingManifestKeys) {
  ServiceTrial trial(python(R"py(for ask in (trial.model, lambda: trial.prior().draw(1)):
    try: ask()
    except RuntimeError as error: print("refused", json.dumps(str(error)))
    else: assert False)py",
                            R"("merit")"),
                     Json::object());
  EXPECT_EQ(trial.run().message, "");
  ASSERT_THAT(trial.logged("refused"), SizeIs(2));
  EXPECT_THAT(trial.refusal(0),
              HasSubstr("relign.model/1 is not granted: declare \"design\" under \"observes\" in the manifest"));
}

// Half an hour of work in the model ends with the current call.
TEST_F(ProcessServices, StopEndsALongModelLoop) {
  for (const char* plugin : {kLibrary, kPython}) {
    for (const char* work : {R"([["step", [0.5, 0.5, 0.5]], ["model_nap", 1800000]])",
                             R"([["step", [0.5, 0.5, 0.5]], ["draw", 1], ["measure", "mean"]])"}) {
      ServiceTrial trial(plugin, {{"script", Json::parse(work)}});
      std::atomic<bool> stop{false};
      trial.algorithm_services.stop = &stop;
      trial.callbacks.on_step = [&](const Step&, const float*) { stop = true; };
      const TrialResult result = trial.run();
      EXPECT_EQ(result.end, End::stopped) << plugin;
      EXPECT_EQ(result.message, "") << "a stop is not a failure";
      EXPECT_THAT(trial.logged("step"), SizeIs(1));
      EXPECT_THAT(trial.logged("measure"), IsEmpty()) << "handlers of failures do not catch Stopped";
    }
  }
}

TEST_F(ProcessServices, DocumentedExamplesMakeTheSameTrial) {
  const Json then = {
      {"use", (fs::path(RELIGN_TASK_TEST_PLUGINS) / "fake_optimizer").string()},
      {"parameters", {{"script", Json::parse(R"([["step", 0.4, 0.5, 0.5], ["step", 0.5, 0.5, 0.6]])")}}}};
  ServiceTrial library("services_example", {{"then", then}}, {{"noise", 0.05}});
  ServiceTrial python("services_example.py", {{"then", then}}, {{"noise", 0.05}});
  const TrialResult result = library.run();
  expect_equal(result, python.run());
  EXPECT_THAT(result.steps, SizeIs(3));
  EXPECT_EQ(library.algorithm.plugin->observes, python.algorithm.plugin->observes);
  for (const std::string& line : library.algorithm_log)
    if (line.rfind("a typical lens", 0) != 0) {
      EXPECT_THAT(python.algorithm_log, Contains(line));
    }
}

}  // namespace
}  // namespace relign::trials::process_services
