// Algorithms that run as processes: their observations, every kind of fault, and clean-up.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "base/files.h"
#include "base/hash.h"
#include "base/text.h"
#include "contract/fake_trial.h"
#include "plugin_host/process_plugin.h"
#include "process_folder.h"

namespace relign::plugin_host {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

class ProcessTest : public test::ProcessFolderTest {
 protected:
  void SetUp() override {
    ProcessFolderTest::SetUp();
    setup_.axes = 2;
    setup_.budget = 4;
    setup_.merit = [](const test::Pose& pose, std::uint32_t) { return test::bowl(pose, {0.3, -0.2}); };
  }

  // A script with relign_bench: the body of run(self, trial).
  fs::path script(const std::string& body, const std::string& members = "") {
    return write("guess.py",
                 "\"\"\"Tries what the test wants.\"\"\"\nimport os, sys, time\n"
                 "from relign_bench.plugin import Optimizer, parameter, serve\n"
                 "class Guess(Optimizer):\n" +
                     indented(members, 4) + "    def run(self, trial):\n" + indented(body, 8) +
                     "if __name__ == '__main__': serve(Guess)\n");
  }
  void run(const fs::path& plugin, const Json& parameters = {}) {
    trial_ = std::make_unique<test::FakeTrial>(setup_);
    Algorithm algorithm(choice(Kind::optimizer, plugin, parameters), services_);
    algorithm.run(trial_->handle());
  }
  std::string failure(const fs::path& plugin) {
    return test::error_text(ErrorKind::plugin_failed, [&] { run(plugin); });
  }

  test::FakeSetup setup_;
  std::unique_ptr<test::FakeTrial> trial_;
};

#ifdef RELIGN_COMPASS
TEST_F(ProcessTest, CompassIsTheSameInBothLanguages) {
  const fs::path examples = fs::path(RELIGN_SOURCE_DIR) / "examples";
  setup_.axes = 5;
  setup_.budget = 400;
  setup_.merit = [](const test::Pose& pose, std::uint32_t step) {
    return test::bowl(pose, {0.31, -0.2, 0.1, 1.0 / 3, -0.45}) + 1e-3 * std::sin(1e3 * step);
  };
  run(examples / "compass_python" / "compass.py", {{"first_stride", 0.07}});
  const auto python = std::move(trial_);
  run(RELIGN_COMPASS, {{"first_stride", 0.07}});
  ASSERT_GT(python->steps.size(), 50U);
  ASSERT_EQ(python->steps.size(), trial_->steps.size());
  for (std::size_t i = 0; i < python->steps.size(); ++i) EXPECT_EQ(python->steps[i].pose, trial_->steps[i].pose) << i;
  ASSERT_EQ(python->recommendations.size(), trial_->recommendations.size());
  for (std::size_t i = 0; i < python->recommendations.size(); ++i) {
    EXPECT_EQ(python->recommendations[i].pose, trial_->recommendations[i].pose);
    EXPECT_EQ(python->recommendations[i].steps_made, trial_->recommendations[i].steps_made);
  }
}
#endif

TEST_F(ProcessTest, RedirectsBytecodeOnlyIfItIsWritten) {
  const fs::path file = script("print('prefix:', sys.pycache_prefix, flush=True)");
  ::unsetenv("PYTHONDONTWRITEBYTECODE");
  run(file);
  EXPECT_THAT(logged_, Contains("prefix: " + (folder_ / "cache/relign-bench/python").string()));
  ::setenv("PYTHONDONTWRITEBYTECODE", "1", 1);  // then the standard library's own bytecode must be found
  run(file);
  EXPECT_THAT(logged_, Contains("prefix: None"));
}

TEST_F(ProcessTest, CachesTheManifestOfAScript) {
  const fs::path file =
      script("pass", R"(stride = parameter(0.25, minimum=0, maximum=1, unit="share", description="How far")
count = parameter(3)
mode = parameter("a", allowed=["a", "b"])
presets = {"guess-wide": {"stride": 0.5}}
observes = ("merit",))");
  Catalog catalog;
  const Choice choice = catalog.resolve_or_throw(Kind::optimizer, file.string(), {{"count", 4}});
  EXPECT_EQ(choice.id, "guess");
  EXPECT_EQ(choice.plugin->summary, "Tries what the test wants.");
  EXPECT_EQ(choice.parameters, Json::parse(R"({"count": 4, "mode": "a", "stride": 0.25})"));
  EXPECT_EQ(catalog.resolve_or_throw(Kind::optimizer, "guess_wide").parameters["stride"], 0.5);
  EXPECT_EQ(choice.plugin->observes, std::vector<std::string>{"merit"});

  // The second time from the cache, whatever its content.
  const fs::path kept = fs::directory_iterator(folder_ / "cache/relign-bench/manifests")->path();
  write(kept, R"({"id": "from-cache", "kind": "optimizer", "summary": "Kept."})");
  EXPECT_EQ(Catalog().resolve_or_throw(Kind::optimizer, file.string()).id, "from-cache");
  // A changed file runs again, and has another hash.
  const std::string before = plugin_hash(*choice.plugin);
  std::ofstream(file, std::ios::app) << "# changed\n";
  const Choice changed = Catalog().resolve_or_throw(Kind::optimizer, file.string());
  EXPECT_EQ(changed.id, "guess");
  EXPECT_NE(plugin_hash(*changed.plugin), before);
}

TEST_F(ProcessTest, HashesImportedModulesOfTheScriptFolder) {
  write("parts/__init__.py", "");
  write("parts/strides.py", "first = 0.25\n");
  write("unused.py", "raise RuntimeError('not imported')\n");
  write("lib/site-packages/other.py", "pass\n");
  const fs::path file = script("pass",
                               "import parts.strides\n"
                               "sys.path.append(os.path.join(os.path.dirname(os.path.abspath(sys.argv[0])), "
                               "'lib', 'site-packages'))\nimport other\n"
                               "stride = parameter(parts.strides.first)");
  const auto asked = [&] { return Catalog().resolve_or_throw(Kind::optimizer, file.string()); };
  const Choice before = asked();
  EXPECT_EQ(before.parameters["stride"], 0.25);
  const Json text = Json::parse(before.plugin->text);
  EXPECT_THAT(text.at("files"), SizeIs(2));
  EXPECT_EQ(text.at("files").at("parts/strides.py"), sha256_file(folder_ / "parts" / "strides.py"));
  EXPECT_EQ(plugin_hash(*asked().plugin), plugin_hash(*before.plugin));
  write("unused.py", "pass\n");
  EXPECT_EQ(plugin_hash(*asked().plugin), plugin_hash(*before.plugin));
  write("parts/strides.py", "first = 0.5  # a longer one\n");
  const Choice after = asked();
  EXPECT_EQ(after.parameters["stride"], 0.5) << "the script ran again";
  EXPECT_NE(plugin_hash(*after.plugin), plugin_hash(*before.plugin));
}

TEST_F(ProcessTest, RejectsManifestThatDiffersFromItsClass) {
  const std::string text =
      read_file(script("trial.step([0, 0])", "observes = (\"merit\", \"box\")\nstride = parameter(0.25, maximum=1)"));
  const auto refused = [&](const std::string& observes, const std::string& parameters) {
    write("beside/guess.py", text);
    write("beside/relign-plugin.json", R"({"id": "guess", "kind": "optimizer", "summary": "Beside.", "observes": )" +
                                           observes + R"(, "parameters": {)" + parameters +
                                           R"(}, "command": ["python3", "guess.py"]})");
    return failure(folder_ / "beside");
  };
  const std::string stride = R"("stride": {"type": "number", "default": 0.25, "maximum": 1)";
  EXPECT_THAT(refused(R"(["merit", "images"])", stride + "}"),
              AllOf(HasSubstr(R"('observes' is ["images","merit"] in the manifest and ["box","merit"] in the class)"),
                    HasSubstr("remove the manifest and use the Python file")));
  EXPECT_THAT(refused(R"(["box", "merit"])", R"("stride": {"type": "number", "default": 0.5, "maximum": 1})"),
              HasSubstr("'default' of parameter 'stride' is 0.5 in the manifest and 0.25 in the class"));
  EXPECT_THAT(refused(R"(["box", "merit"])", ""), HasSubstr("parameter 'stride' is missing in the manifest"));
  EXPECT_THAT(refused(R"(["box", "merit"])", stride + R"(}, "count": {"type": "integer", "default": 1})"),
              HasSubstr("parameter 'count' is"));
  // Descriptions may differ.
  write("beside/relign-plugin.json",
        R"({"id": "guess", "kind": "optimizer", "summary": "Beside.", "observes": ["box", "merit"],
      "parameters": {)" +
            stride + R"(, "description": "How far"}}, "command": ["python3", "guess.py"]})");
  run(folder_ / "beside");
  EXPECT_THAT(trial_->steps, SizeIs(1));
}

TEST_F(ProcessTest, RejectsScriptsThatAreNotPlugins) {
  const fs::path broken = write("broken.py", "raise RuntimeError('no config file')\n");
  EXPECT_THAT(test::error_text(ErrorKind::plugin_rejected, [&] { run(broken); }),
              AllOf(HasSubstr("broken.py is not a plugin"), HasSubstr("failed: RuntimeError: no config file"),
                    HasSubstr("status 1"), Not(HasSubstr("serve(YourClass)"))));
  const fs::path misspelt = write("misspelt.py",
                                  "\"\"\"Declares observe.\"\"\"\nfrom relign_bench.plugin import Optimizer, serve\n"
                                  "class Guess(Optimizer):\n    observe = ('images',)\n"
                                  "    def run(self, trial): pass\nserve(Guess)\n");
  EXPECT_THAT(test::error_text(ErrorKind::plugin_rejected, [&] { run(misspelt); }),
              HasSubstr("Guess has the attribute 'observe'; did you mean 'observes'?"));
  const fs::path silent = write("silent.py", "print('hello')\n");
  EXPECT_THAT(test::error_text(ErrorKind::plugin_rejected, [&] { run(silent); }),
              AllOf(HasSubstr("end the file with serve(YourClass)"), HasSubstr("hello")));
  write("lost/relign-plugin.json",
        R"({"id": "lost", "kind": "optimizer", "summary": "Lost.", "command": ["no-such-program-here"]})");
  EXPECT_THAT(test::error_text(ErrorKind::plugin_rejected, [&] { run(folder_ / "lost"); }),
              AllOf(HasSubstr("'lost'"), HasSubstr("cannot start 'no-such-program-here'")));
  write("both/relign-plugin.json", R"({"id": "both", "kind": "scene", "summary": "Both.", "library": "both.so",
                                       "command": ["sh"]})");
  EXPECT_THAT(test::error_text(ErrorKind::plugin_rejected, [&] { run(folder_ / "both"); }), HasSubstr("not both"));
}

TEST_F(ProcessTest, RunsWithAnotherPython) {
  const fs::path guess = write("guess.py",
                               "\"\"\"Ends at once.\"\"\"\nfrom relign_bench.plugin import Optimizer, serve\n"
                               "class Guess(Optimizer):\n    def run(self, trial): pass\nserve(Guess)\n");
  const fs::path own =
      write("own_python", "#!/bin/sh\necho \"$1\" >> '" + (folder_ / "asked").string() + "'\nexec python3 \"$@\"\n");
  fs::permissions(own, fs::perms::owner_all);
  ::setenv("RELIGN_PYTHON", own.c_str(), 1);
  run(guess);
  ::unsetenv("RELIGN_PYTHON");
  EXPECT_THAT(read_file(folder_ / "asked"), HasSubstr("guess.py"));
}

TEST_F(ProcessTest, PassesTheWholeTask) {
  setup_.seed = ~std::uint64_t{0};
  setup_.largest_move = 0.125;
  run(script(R"(assert trial.seed == 2**64 - 1 and trial.budget == 4 and trial.largest_move == 0.125
assert [axis["name"] for axis in trial.axes] == ["a0", "a1"]
assert trial.box.lower == (-0.5, -0.5) and trial.box.centre() == [0.0, 0.0]
assert trial.observes == {"merit", "box"}
first = trial.first
assert first.step == 0 and first.pose == (0.0, 0.0) and first.limits == (0, 0) and first.machine_seconds == 0
seen = trial.move([1/3, -0.1])
assert seen.pose == (0.125, -0.1) and seen.step == 1, seen
try: seen.image
except RuntimeError as error: assert "images" in str(error)
else: assert False
for bad in ([1], [0, float("nan")], [0, float("inf")], ["x", "y"]):
    try: trial.step(bad)
    except ValueError: pass
    else: assert False, bad
while trial.step([0, 0]): pass)"));
  EXPECT_TRUE(trial_->stopped);
  EXPECT_FALSE(trial_->refused);
  EXPECT_THAT(trial_->steps, SizeIs(4));
}

TEST_F(ProcessTest, PassesPixelsWithAndWithoutNumpy) {
  setup_.observes |= RELIGN_OBSERVES_IMAGES;
  const std::string body = R"(for target in ([0.1, 0.2], [0.3, 0.1]):
    seen = trial.step(target)
    image = seen.image
    assert image.shape == (8, 8) and len(image) == 8
    assert abs(image[7, 7] - seen.merit) < 1e-6 and abs(image[0][3] - seen.merit) < 1e-6
    try: image[0, 0] = 1
    except (TypeError, ValueError): pass
    else: assert False, "pixels are read-only"
kept = seen.image
unseen = trial.step([0, 0])
trial.step([0.1, 0])
assert abs(kept[0, 0] - seen.merit) < 1e-6, "arrays may be kept"
try: unseen.image
except RuntimeError as error: assert "are gone" in str(error)
else: assert False
print("array:", type(image).__module__))";
  const std::string observes = "observes = (\"merit\", \"box\", \"images\")";
  const fs::path file = script(body, observes);
  write("plain/guess.py", read_file(file));
  write("plain/relign-plugin.json",
        R"({"id": "guess", "kind": "optimizer", "summary": "No site packages.", "observes": ["merit", "box", "images"],
            "command": ["python3", "-S", "guess.py"]})");
  run(folder_ / "plain");
  EXPECT_THAT(logged_, Contains("array: relign_bench.plugin"));
  if (!runs("python3 -c 'import numpy'")) GTEST_SKIP() << "numpy is not installed; tested without it";
  run(file);
  EXPECT_THAT(logged_, Contains("array: numpy"));
}

TEST_F(ProcessTest, PreventsShrinkingOfSharedPixels) {
  setup_.observes |= RELIGN_OBSERVES_IMAGES;
  run(script(R"(file = os.open("/proc/self/fd/5", os.O_RDWR)
try: os.ftruncate(file, 0)
except OSError: pass
else: assert False, "a smaller file would kill the host"
assert trial.step([0.1, 0.2]).image.shape == (8, 8))",
             R"(observes = ("images",))"));
  EXPECT_THAT(trial_->steps, SizeIs(1));
}

TEST_F(ProcessTest, AcceptsAnyAmountOfOutput) {
  run(script(R"(print("here I am")
for i in range(20000):
    print("x" * 50, file=sys.stderr if i % 2 else sys.stdout)
print("y" * 1000)
os.write(1, b'{"message":"done"}\n')
assert sys.stdin.read() == ""
trial.step([0.1, 0.1]))"));
  EXPECT_THAT(trial_->steps, SizeIs(1));
  ASSERT_FALSE(logged_.empty());
  EXPECT_EQ(logged_.front(), "here I am");
  EXPECT_EQ(std::count(logged_.begin(), logged_.end(), std::string(50, 'x')), 20000);
  EXPECT_THAT(logged_, Contains(std::string(1000, 'y')));
}

TEST_F(ProcessTest, ReportsExceptionsWithLine) {
  const std::string text = failure(script("trial.step([0, 0])\nraise KeyError('the third lens')"));
  EXPECT_THAT(text, AllOf(HasSubstr("plugin 'guess' failed in run: KeyError: 'the third lens' (guess.py, line 7)"),
                          HasSubstr("ended with exit status 1"), HasSubstr("Traceback")));
  EXPECT_THAT(trial_->steps, SizeIs(1)) << "completed steps are kept";
  EXPECT_THAT(failure(script("pass", "def __init__(self): raise ValueError('no model')")),
              AllOf(HasSubstr("failed in create"), HasSubstr("ValueError: no model")));
}

TEST_F(ProcessTest, ReportsCrashes) {
  EXPECT_THAT(failure(raw("sys.exit('no licence')")),
              AllOf(HasSubstr("failed in the handshake"), HasSubstr("exit status 1"), HasSubstr("no licence")));
  EXPECT_THAT(failure(raw("begin(); print('last words', flush=True); os.kill(os.getpid(), 11)")),
              AllOf(HasSubstr("failed in run"), HasSubstr("killed by SIGSEGV"), HasSubstr("\n  last words")));
  // Of a missing package one sentence, and no traceback.
  EXPECT_EQ(
      failure(raw("import nosuch.part")),
      "plugin 'raw' failed in the handshake: No module named 'nosuch'; install its package, `python3 -m pip install "
      "nosuch` if it has the module's name, or set RELIGN_PYTHON to a Python that has it");
  logged_.clear();
  EXPECT_THAT(failure(script("import nosuch")),
              AllOf(HasSubstr("failed in run: No module named 'nosuch' (guess.py, line 6); install its package"),
                    Not(HasSubstr("Traceback"))));
  EXPECT_EQ(failure(script("raise ModuleNotFoundError('Optics is missing: pip install optics')")),
            "plugin 'guess' failed in run: Optics is missing: pip install optics (guess.py, line 6)");
  EXPECT_THAT(logged_, IsEmpty());
  EXPECT_THAT(failure(raw("begin(); os._exit(0)")),
              AllOf(HasSubstr("closed the connection"), HasSubstr("ended with exit status 0")));
  EXPECT_THAT(failure(script("trial.step([0, 0]); sys.exit(0)")), HasSubstr("it called sys.exit(0) during the trial"));
  EXPECT_THAT(failure(raw("begin(); say('{\"message\":\"st'); os._exit(3)")),
              AllOf(HasSubstr("in the middle of a message"), HasSubstr("exit status 3")));
}

TEST_F(ProcessTest, ReportsMalformedMessages) {
  EXPECT_THAT(failure(raw("begin(); say('hello there\\n'); hear()")),
              HasSubstr("malformed message 'hello there': invalid JSON"));
  EXPECT_THAT(failure(raw("begin(); say('[1, 2]\\n'); hear()")),
              HasSubstr("malformed message '[1, 2]': expected an object"));
  EXPECT_THAT(failure(raw("begin(); say('{\"message\":7}\\n'); hear()")),
              HasSubstr("expected an object with a string 'message'"));
  EXPECT_THAT(failure(raw("begin(); say('{\"message\":\"step\",\"pose\":\"up\"}\\n'); hear()")),
              HasSubstr("malformed message 'step': expected a list of numbers 'pose'"));
  EXPECT_THAT(failure(raw("begin(); say('x' * 3000000); hear()")), HasSubstr("more than a million bytes"));
  EXPECT_THAT(failure(raw("hear(); say('{\"message\":\"hello\",\"protocol\":1,\"id\":\"other\"}\\n'); hear()")),
              HasSubstr("found the id 'other'; expected 'raw' as in the manifest"));
  EXPECT_THAT(failure(raw("hear(); say('{\"message\":\"hello\",\"protocol\":9,\"id\":\"raw\"}\\n'); hear()")),
              HasSubstr("protocol version"));
  EXPECT_THAT(
      failure(
          raw("hear(); say('{\"message\":\"hello\",\"protocol\":1,\"id\":\"raw\",\"needs\":[\"gpu\"]}\\n'); hear()")),
      HasSubstr("abilities that this host lacks: [\"gpu\"]"));
}

TEST_F(ProcessTest, AnswersUnknownRequestsAndInvalidPoses) {
  run(raw(R"(begin()
say('{"message":"step","pose":[1],"later":{}}\n'); assert hear()["message"] == "refused"
say('{"message":"step","pose":[1,null]}\n'); assert hear()["message"] == "refused"
say('{"message":"service","id":"crystal ball"}\n'); assert hear()["message"] == "unsupported"
say('{"message":"step","pose":[0.5,0.25]}\n'); assert hear()["pose"] == [0.5, 0.25]
say('{"message":"done"}\n'))"));
  EXPECT_THAT(trial_->steps, SizeIs(1));
}

// Importing a large package takes more than half a minute on a loaded machine.
TEST_F(ProcessTest, HasTheTimeToStartThatTheDocumentStates) {
  const double seconds = ProcessTimeouts().handshake_seconds;
  EXPECT_GE(seconds, 120);
  EXPECT_THAT(read_file(RELIGN_SOURCE_DIR "/docs/process_plugins.md"),
              HasSubstr("| " + shortest(seconds) + " | from the start of a process until `created`"));
}

TEST_F(ProcessTest, KillsHangingProcessWithItsGroup) {
  ::setenv("RELIGN_HANDSHAKE_SECONDS", "1.5", 1);
  EXPECT_THAT(failure(raw("print('thinking', flush=True); time.sleep(100)")),
              AllOf(HasSubstr("failed in the handshake: it did not answer in time"), HasSubstr("was killed")));
  ::unsetenv("RELIGN_HANDSHAKE_SECONDS");
  ::setenv("RELIGN_STOP_SECONDS", "0.4", 1);
  EXPECT_THAT(failure(raw("begin(); say('{\"mess'); time.sleep(100)")),
              HasSubstr("an incomplete message and then nothing more"));
  EXPECT_THAT(failure(script("while trial.step([0, 0]): pass\n"
                             "import subprocess\n"
                             "child = subprocess.Popen(['sleep', '100'])\n"
                             "print('child', child.pid)\n"
                             "time.sleep(100)")),
              HasSubstr("it did not return in time after a stop"));
  // The most common mistake: a loop that ignores the result of step.
  EXPECT_THAT(failure(script("while True: trial.step([0.5, 0.5])")),
              AllOf(HasSubstr("stops (step() returns None when there are no more steps)"), HasSubstr("was killed")));
  ASSERT_THAT(logged_, Contains(HasSubstr("child ")));
  const std::string process = logged_.back().substr(6);
  const auto lives = [&] {
    std::ifstream stat("/proc/" + process + "/stat");
    std::string text;
    return std::getline(stat, text) && text.find(") Z") == std::string::npos;
  };
  for (int wait = 0; wait < 200 && lives(); ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_FALSE(lives()) << "its children must be killed with it";
}

TEST_F(ProcessTest, LeavesNothingBehindAfterTwoHundredTrials) {
  // A plugin may be in any language, here the shell.
  write("tiny/tiny.sh", R"(read -r hello <&4; echo '{"message":"hello","protocol":1,"id":"tiny"}' >&3
read -r create <&4; echo '{"message":"created"}' >&3
read -r run <&4; echo '{"message":"step","pose":[0.25,-0.5]}' >&3
read -r seen <&4; echo '{"message":"done"}' >&3; read -r bye <&4)");
  write("tiny/relign-plugin.json",
        R"({"id": "tiny", "kind": "optimizer", "summary": "A shell script.", "command": ["sh", "tiny.sh"]})");
  const auto descriptors = [] {
    return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
  };
  run(folder_ / "tiny");
  const auto before = descriptors();
  for (int trial = 0; trial < 200; ++trial) {
    run(folder_ / "tiny");
    ASSERT_THAT(trial_->steps, SizeIs(1));
    ASSERT_EQ(trial_->steps[0].pose, (test::Pose{0.25, -0.5}));
  }
  EXPECT_EQ(descriptors(), before);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1) << "a child is left";
}

TEST_F(ProcessTest, PropagatesHostExceptionsUnchanged) {
  setup_.merit = [](const test::Pose&, std::uint32_t step) -> double {
    if (step == 2) throw Error(ErrorKind::io, "the camera is unplugged");
    return 0.5;
  };
  EXPECT_EQ(test::error_text(ErrorKind::io, [&] { run(script("while trial.step([0, 0]): pass")); }),
            "the camera is unplugged");
}

// Not asserted, because the cost depends on the load of the machine. docs/process_plugins.md has a figure.
TEST_F(ProcessTest, PrintsTheCostOfAStep) {
  setup_.budget = 5000;
  setup_.axes = 5;
  setup_.merit = [](const test::Pose&, std::uint32_t step) { return 1.0 / (1 + step); };
  run(script(R"py(trial.step([0.1] * 5)
costs = []
for batch in range(40):
    start = time.perf_counter()
    for i in range(100): trial.step([0.1, 0.2, 0.3, 0.4, i * 1e-5])
    costs.append((time.perf_counter() - start) / 100 * 1e6)
costs.sort()
print("cost %.1f microseconds (median of 40 batches; quickest %.1f)" % (costs[20], costs[0]))
)py"));
  ASSERT_THAT(trial_->steps, SizeIs(4001));
  ASSERT_FALSE(logged_.empty());
  std::printf("             a step across processes: %s\n", logged_.back().c_str() + 5);
}

}  // namespace
}  // namespace relign::plugin_host
