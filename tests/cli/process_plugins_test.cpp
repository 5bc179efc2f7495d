// Python plugins of every kind on the command line: paths as ids, equality with C++ plugins, crashes, hangs, output.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kExample = RELIGN_SOURCE_DIR "/examples/compass_python/compass.py";
const std::string kCompass =
    fs::path(RELIGN_PLUGIN_DIR).parent_path().parent_path().parent_path() / "out_of_tree/compass";

#define RELIGN_NEEDS_PYTHON() \
  if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "python3 is not installed"

TEST(CliProcessPlugins, PythonAndCppCompassRunTheSameTrial) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  for (const char* protocol : {"paper", "blind"}) {
    json trials[2];
    const std::string paths[2] = {kExample, kCompass};
    for (int i = 0; i < 2; ++i) {
      const Outcome outcome = relign_bench(place, {"--json", "try", paths[i], "--steps", "15", "--protocol", protocol});
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
      trials[i] = json::parse(outcome.out);
      trials[i].erase("algorithm");
    }
    EXPECT_EQ(trials[0]["steps"].size(), 16U);
    EXPECT_EQ(trials[0], trials[1]) << protocol;
  }
}

TEST(CliProcessPlugins, CrashFailsOnlyItsOwnTrials) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  fs::copy_file(kExample, place.path("compass.py"));
  place.write("dies.py", R"("""Exits in the second step."""
import os
from relign_bench.plugin import Optimizer, serve
class Dies(Optimizer):
    def run(self, trial):
        trial.step(trial.box.centre())
        print("goodbye")
        os._exit(7)
if __name__ == "__main__": serve(Dies)
)");
  place.write("suite.json", R"({"scenes": ["relign_od"], "noise_levels": ["rho0.25"], "instances": 2, "steps": 3,
                                "algorithms": ["./compass.py", "./dies.py"]})");
  const Outcome outcome = relign_bench(place, {"run", "suite.json", "--out", "out", "--workers", "2"});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;  // finished, some trials failed
  const std::string trials = place.read("out/trials/0000.jsonl");
  EXPECT_THAT(trials, HasSubstr("plugin 'dies' failed in run"));
  EXPECT_THAT(trials, HasSubstr("ended with exit status 7"));
  EXPECT_THAT(trials, HasSubstr("goodbye"));
  const json manifest = json::parse(place.read("out/manifest.json"));
  EXPECT_EQ(manifest["algorithms"][0]["name"], "compass");
  EXPECT_EQ(manifest["algorithms"][0]["plugin_hash"].get<std::string>().size(), 64U);
}

TEST(CliProcessPlugins, APluginThatKillsItselfGetsNoOtherRun) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  place.write("quits.py", R"("""Kills itself."""
import os, signal
from relign_bench.plugin import Optimizer, serve
class Quits(Optimizer):
    def run(self, trial):
        trial.step(trial.box.centre())
        with open(os.environ["RUNS"], "a") as out: out.write("run\n")
        os.kill(os.getpid(), signal.SIGKILL)
if __name__ == "__main__": serve(Quits)
)");
  ::setenv("RUNS", place.path("runs").c_str(), 1);
  place.write("suite.json", R"({"scenes": ["gaussian_spot"], "noise_levels": ["none"], "instances": 1, "steps": 3,
                                "algorithms": ["./quits.py"]})");
  const Outcome outcome = relign_bench(place, {"run", "suite.json", "--out", "out"});
  ::unsetenv("RUNS");
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_EQ(place.read("runs"), "run\n");
  EXPECT_THAT(place.read("out/trials/0000.jsonl"), HasSubstr("crashed(SIGKILL)"));
}

TEST(CliProcessPlugins, PluginProcessEndsWithTheKilledProgram) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  place.write("loops.py", R"("""Runs an endless loop."""
import os, subprocess
from relign_bench.plugin import Optimizer, serve
class Loops(Optimizer):
    def run(self, trial):
        trial.step(trial.box.centre())
        other = subprocess.Popen(["sleep", "1000"])
        with open("pids.part", "w") as out: print(os.getpid(), other.pid, file=out)
        os.rename("pids.part", "pids")
        while True: pass
if __name__ == "__main__": serve(Loops)
)");
  const auto within_30_s = [](const auto& happens) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!happens() && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return happens();
  };
  Running program(place, {RELIGN_PROGRAM, "try", "./loops.py"});
  ASSERT_TRUE(within_30_s([&] { return fs::exists(place.path("pids")); })) << program.wait().err;
  std::istringstream pids(place.read("pids"));
  pid_t loop = 0, other = 0;
  pids >> loop >> other;
  ASSERT_EQ(::kill(loop, 0), 0);
  program.send(SIGKILL);
  program.wait();
  for (const pid_t process : {loop, other})
    EXPECT_TRUE(within_30_s([&] { return ::kill(process, 0) != 0; })) << "process " << process << " is still there";
}

TEST(CliProcessPlugins, AcceptsPathsOfScenesStationsAndNoiseLevels) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  fs::copy(RELIGN_SOURCE_DIR "/tests/harness/runner/python_toys", place.path("toys"));
  place.write("suite.json", R"({"scenes": ["toys/toy_scene.py"], "noise_levels": ["./toys/toy_level.py", "toy-wild"],
                                "algorithms": ["nlopt-sbplx"], "instances": 2, "steps": 3})");
  const Outcome valid = relign_bench(place, {"validate", "suite.json"});
  EXPECT_EQ(valid.exit_code, 0) << valid.err;
  const Outcome outcome = relign_bench(place, {"run", "suite.json", "--out", "out", "--workers", "2"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json manifest = json::parse(place.read("out/manifest.json"));
  EXPECT_EQ(manifest["scenes"][0]["name"], "toy-scene");
  EXPECT_EQ(manifest["noise_levels"].size(), 2U);
  EXPECT_TRUE(fs::exists(place.path("out/pictures/toy-scene/reference.png")));

  place.write("bench.json", R"({"scenes": ["./toys/toy_station.py"], "noise_levels": ["none"],
                                "algorithms": ["random"], "instances": 2, "steps": 3})");
  const Outcome station = relign_bench(place, {"run", "bench.json", "--out", "bench"});
  ASSERT_EQ(station.exit_code, 0) << station.err;
  EXPECT_THAT(station.out, HasSubstr("measured only"));
  const Outcome tried = relign_bench(
      place, {"try", "random", "--scene", "toys/toy_scene.py", "--noise-level", "toys/toy_level.py", "--steps", "2"});
  EXPECT_EQ(tried.exit_code, 0) << tried.err;
  const Outcome wrong = relign_bench(place, {"try", "random", "--scene", "toys/toy_level.py"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("is a plugin of the kind noise-level; expected a scene"));
}

TEST(CliProcessPlugins, StationMayStopItsMotorsAtTheEndOfARun) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  fs::copy(RELIGN_SOURCE_DIR "/tests/harness/runner/python_toys", place.path("toys"));
  place.write("toys/stopping.py", R"("""A station that stops its motors when its process is asked to end."""
import pathlib, signal
from relign_bench.plugin import serve
from toy_station import ToyStation
def end(number, frame): raise SystemExit
class Stopping(ToyStation):
    id = "stopping"
    def begin(self, seed):
        signal.signal(signal.SIGTERM, end)
        super().begin(seed)
if __name__ == "__main__":
    try: serve(Stopping)
    finally: pathlib.Path(__file__).with_name("stopped").write_text("STOP")
)");
  place.write("suite.json", R"({"scenes": ["./toys/stopping.py"], "noise_levels": ["none"], "protocol": "blind",
                                "algorithms": ["random"], "instances": 1, "steps": 2})");
  const Outcome outcome = relign_bench(place, {"run", "suite.json", "--out", "out"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(place.read("toys/stopped"), "STOP");
}

TEST(CliProcessPlugins, ConformanceChecksEveryKind) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  const std::string toys = RELIGN_SOURCE_DIR "/tests/harness/runner/python_toys/";
  const auto finding = [&place](const std::string& plugin, const std::string& check) {
    return relign_bench(place, {"plugin", "check", "--one", check, "--report", "1", plugin}).out;
  };
  for (const char* check : {"description", "same-pixels", "truth", "elements", "travel"})
    EXPECT_THAT(finding(toys + "toy_scene.py", check), HasSubstr(R"("verdict":"ok")")) << check;
  for (const char* check : {"reference", "stage"})
    EXPECT_THAT(finding(toys + "toy_station.py", check), HasSubstr(R"("verdict":"ok")")) << check;
  EXPECT_THAT(finding(toys + "toy_level.py", "perturbations"), HasSubstr(R"("verdict":"ok")"));
  EXPECT_THAT(finding(toys + "toy_level.py", "symbols"), HasSubstr("it runs as a process and has no library"));
  // The start depends on the process, not only on the seed.
  place.write("moody.py", R"("""Draws what depends on its process."""
import os
from relign_bench.plugin import NoiseLevel, serve
class Moody(NoiseLevel):
    def draw(self, seed, scene):
        n = len(scene["axes"])
        unit = [[float(i == j) for j in range(n)] for i in range(n)]
        return {"start": [(seed % 7 + os.getpid() % 1000 / 1000) / 8] * n, "distortion": unit, "elements": {}}
if __name__ == "__main__": serve(Moody)
)");
  EXPECT_THAT(finding("moody.py", "same-draw"),
              HasSubstr("a second object of 'moody' draws differently for the same seed"));
}

TEST(CliProcessPlugins, AMissingDocstringIsOneSentence) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  place.write(
      "nodoc.py",
      "from relign_bench.plugin import Optimizer, serve\n\n\nclass Nodoc(Optimizer):\n    def run(self, trial):\n"
      "        pass\n\n\nserve(Nodoc)\n");
  const Outcome outcome = relign_bench(place, {"try", "./nodoc.py"});
  EXPECT_EQ(outcome.exit_code, 5) << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("nodoc.py cannot be used: the class Nodoc needs a docstring"),
                                 Not(HasSubstr("Traceback"))));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

TEST(CliProcessPlugins, LogsOutputOfPlugins) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  place.write("prints.py", R"("""Prints, and exits if the file die exists."""
import os, sys
from relign_bench.plugin import Optimizer, serve
class Prints(Optimizer):
    def run(self, trial):
        for line in range(20): print("line", line, file=sys.stderr if line % 2 else sys.stdout)
        if os.path.exists("die"): os._exit(7)
if __name__ == "__main__": serve(Prints)
)");
  place.write("suite.json", R"({"scenes": ["relign_od"], "noise_levels": ["rho0.25"], "instances": 2, "steps": 1,
                                "algorithms": ["./prints.py", "random", "home"]})");
  place.write("die", "");
  const std::vector<std::string> arguments = {"run", "suite.json", "--out", "out", "--workers", "2"};
  const Outcome failed = relign_bench(place, arguments);
  ASSERT_EQ(failed.exit_code, 3) << failed.err;
  std::string all;
  for (int line = 0; line < 20; ++line) all += "line " + std::to_string(line) + "\n";
  const auto logs = [&] {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(place.path("out/logs")))
      found.push_back("logs/" + entry.path().filename().string());
    return found;
  };
  ASSERT_EQ(logs().size(), 2U) << "only trials that printed have one";
  const std::string page = place.read("out/report.html");
  for (const std::string& log : logs()) {
    EXPECT_EQ(place.read("out/" + log), all);
    EXPECT_THAT(failed.err, HasSubstr("output of its plugins: out/" + log));
    EXPECT_THAT(page, HasSubstr(log));
  }
  // A new version prints nothing: the trials run again and their old logs are removed.
  const std::string script = place.read("prints.py");
  place.write("prints.py", script.substr(0, script.find("        for line")) + "        trial.first\n" +
                               script.substr(script.find("if __name__")));
  const Outcome again = relign_bench(place, arguments);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(logs().empty());
}

TEST(CliProcessPlugins, ProvidesServices) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  place.write("asks.py", R"("""Uses the host's services."""
from relign_bench.plugin import Optimizer, serve
class Asks(Optimizer):
    observes = ("merit", "images", "level")
    def run(self, trial):
        seen, wanted = trial.first, trial.reference
        image = seen.image
        height, width = wanted.shape
        assert image.shape == wanted.shape
        squares = sum((float(image[y, x]) - float(wanted[y, x])) ** 2 for y in range(height) for x in range(width))
        print("rmse", (squares / (height * width)) ** 0.5)
        names = [entry["name"] for entry in trial.measures().list()]
        print("measures", names, trial.measures().measure(names[0]))
        drawn = trial.prior().draw(3)
        assert drawn == trial.prior().draw(3) != trial.prior().draw(4)
        print("prior", sorted(drawn))
        for wrong in (lambda: trial.measures().measure("beauty"), lambda: trial.prior().draw(-1), lambda: trial.box):
            try: wrong()
            except (ValueError, RuntimeError) as error: print("refused", error)
            else: assert False
if __name__ == "__main__": serve(Asks)
)");
  const Outcome outcome = relign_bench(place, {"--json", "try", "./asks.py", "--steps", "2", "--protocol", "blind"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const double measured = json::parse(outcome.out)["steps"][0]["measured"];
  const std::size_t at = outcome.err.find("rmse ");
  ASSERT_NE(at, std::string::npos) << outcome.err;
  EXPECT_NEAR(std::stod(outcome.err.substr(at + 5)), measured, 1e-9) << "pixels and reference are the host's";
  EXPECT_THAT(outcome.err, HasSubstr("measures ['"));
  EXPECT_THAT(outcome.err, HasSubstr("prior ['distortion', 'elements', 'start']"));
  EXPECT_THAT(outcome.err, HasSubstr("refused "));
}

TEST(CliProcessPlugins, TryPrintsOutputOfPlugins) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  place.write("talks.py", R"("""Prints."""
from relign_bench.plugin import Optimizer, serve
class Drives(Optimizer):
    def run(self, trial):
        print("start", trial.first.step)
if __name__ == "__main__": serve(Drives)
)");
  place.write("level.py", R"("""Prints too."""
from relign_bench.plugin import NoiseLevel, serve
class Level(NoiseLevel):
    def draw(self, seed, scene):
        print("axes", len(scene["axes"]))
        return {"start": [0.5] * 5, "distortion": [[float(i == j) for j in range(5)] for i in range(5)], "elements": {}}
if __name__ == "__main__": serve(Level)
)");
  const Outcome outcome =
      relign_bench(place, {"--json", "try", "./talks.py", "--noise-level", "./level.py", "--steps", "2"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("axes 5"), HasSubstr("start 0")));
  EXPECT_EQ(json::parse(outcome.out)["end"], "finished");
}

TEST(CliProcessPlugins, PythonAndCppGetTheSameServices) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  json trials[2];
  std::string output[2];
  const std::string plugins[2] = {RELIGN_SERVICES_EXAMPLE, RELIGN_SERVICES_EXAMPLE ".py"};
  for (int i = 0; i < 2; ++i) {
    const Outcome outcome =
        relign_bench(place, {"--json", "try", plugins[i], "--steps", "8", "--parameters",
                             R"({"then": {"use": "nlopt-sbplx", "parameters": {"first_stride": 0.1}}})"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    trials[i] = json::parse(outcome.out);
    trials[i].erase("algorithm");
    std::istringstream lines(outcome.err);
    for (std::string line; std::getline(lines, line);)
      if (line.find("typical lens") == std::string::npos && line.find("ended the trial") == std::string::npos)
        output[i] += line + "\n";  // a draw is text in C++ and a dictionary in Python
  }
  EXPECT_EQ(trials[0]["steps"].size(), 5U);
  EXPECT_EQ(trials[0], trials[1]);
  EXPECT_EQ(output[0], output[1]);
  EXPECT_THAT(output[0], HasSubstr("the model's first pixel"));
}

// Waits for a file that the plugin writes; false if the program ends first.
bool wait_for(const fs::path& file, Running& run) {
  for (int waited_ms = 0; waited_ms < 60000 && !run.ended(); waited_ms += 5) {
    if (fs::exists(file)) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

// Hangs in its first step or while it is created, unless the file go-on exists.
const char* const kHangs = R"("""Hangs."""
import os, time
from relign_bench.plugin import Optimizer, serve

def think(where):
    if os.path.exists("go-on"): return
    if not os.path.exists("hang-in-" + where): return
    with open("pid", "w") as file: file.write(str(os.getpid()))
    os.rename("pid", "thinking")
    time.sleep(3600)

class Hangs(Optimizer):
    def __init__(self): think("create")
    def run(self, trial):
        trial.step(trial.box.centre())
        think("run")
        while trial.step(trial.box.centre()): pass
if __name__ == "__main__": serve(Hangs)
)";

void stop_while_it_hangs(const std::string& where, int signal, int exit_code, const std::string& message) {
  const Workplace place;
  place.write("hangs.py", kHangs);
  place.write("hang-in-" + where, "");
  place.write("suite.json", R"({"scenes": ["relign_od"], "noise_levels": ["rho0.25"], "instances": 2, "steps": 3,
                                "algorithms": ["random", "./hangs.py", "home"]})");
  const std::vector<std::string> arguments = {"run",       "suite.json", "--out",      "out",
                                              "--workers", "1",          "--progress", "none"};
  std::vector<std::string> command = {RELIGN_PROGRAM};
  command.insert(command.end(), arguments.begin(), arguments.end());
  Options options;
  options.environment["RELIGN_STOP_SECONDS"] = "0.3";
  Running run(place, command, options);
  ASSERT_TRUE(wait_for(place.path("thinking"), run)) << run.wait().err;
  run.send(signal);
  const Outcome stopped = run.wait();
  EXPECT_EQ(stopped.exit_code, exit_code) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr(message));
  EXPECT_THAT(stopped.err, HasSubstr("run the same command"));
  EXPECT_NE(::kill(std::stoi(place.read("thinking")), 0), 0) << "the plugin's process still runs";
  EXPECT_THAT(place.read("out/trials/0000.jsonl"), Not(HasSubstr("failed")));

  place.write("go-on", "");
  const Outcome resumed = relign_bench(place, arguments);
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(relign_bench(place, {"run", "suite.json", "--out", "whole"}).exit_code, 0);
  EXPECT_EQ(place.read("out/trials/0000.jsonl"), place.read("whole/trials/0000.jsonl"));
}

TEST(CliProcessPlugins, CtrlCStopsHangingTrial) {
  RELIGN_NEEDS_PYTHON();
  stop_while_it_hangs("run", SIGINT, 130, "Stopped with 1 of 6 trials done");
}

TEST(CliProcessPlugins, SigtermStopsHangingCreation) {
  RELIGN_NEEDS_PYTHON();
  stop_while_it_hangs("create", SIGTERM, 75, "Stopped before the first trial");
}

TEST(CliProcessPlugins, CtrlCStopsHangingTry) {
  RELIGN_NEEDS_PYTHON();
  const Workplace place;
  place.write("hangs.py", kHangs);
  place.write("hang-in-run", "");
  Options options;
  options.environment["RELIGN_STOP_SECONDS"] = "0.3";
  Running run(place, {RELIGN_PROGRAM, "try", "./hangs.py"}, options);
  ASSERT_TRUE(wait_for(place.path("thinking"), run)) << run.wait().err;
  run.send(SIGINT);
  const Outcome stopped = run.wait();
  EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr("Stopped. To run the trial again from step 0"));
}

// Never comes back from a move by itself; SIGTERM stops its motors.
const char* const kSlowStation = R"("""A station whose move takes an hour."""
import array, signal, sys, time
from relign_bench.plugin import Station, serve

def stop_motors(number, frame):
    open("stopped", "w").close()
    sys.exit(0)

class SlowStation(Station):
    id = "slow-station"
    def describe(self):
        axes = [{"name": name, "unit": "mm", "lower": -1, "upper": 1} for name in "xy"]
        return {"name": "slow station", "axes": axes, "image": {"width": 2, "height": 2, "white": 1}}
    def reference(self): return array.array("f", [0, 0, 0, 1])
    def begin(self, seed): pass
    def move_by(self, delta):
        signal.signal(signal.SIGTERM, stop_motors)
        open("thinking", "w").close()
        time.sleep(3600)
    def capture(self): return array.array("f", [0, 0, 0, 1]), 0.5
if __name__ == "__main__": serve(SlowStation)
)";

TEST(CliProcessPlugins, AStoppedStationIsAskedToStopItsMotors) {
  RELIGN_NEEDS_PYTHON();
  for (const bool tried : {true, false}) {
    const Workplace place;
    place.write("slow.py", kSlowStation);
    place.write("suite.json", R"({"scenes": ["./slow.py"], "noise_levels": ["none"], "algorithms": ["random"],
                                  "instances": 1, "steps": 3})");
    Options options;
    if (tried) options.environment["RELIGN_STOP_SECONDS"] = "0.3";
    std::vector<std::string> command = {RELIGN_PROGRAM, "run", "suite.json"};
    if (tried) command = {RELIGN_PROGRAM, "try", "random", "--scene", "./slow.py", "--noise-level", "none"};
    Running run(place, command, options);
    ASSERT_TRUE(wait_for(place.path("thinking"), run)) << run.wait().err;
    run.send(SIGINT);
    const Outcome stopped = run.wait();
    EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
    EXPECT_TRUE(fs::exists(place.path("stopped"))) << stopped.err;
    if (tried) {
      EXPECT_THAT(stopped.err, HasSubstr("was told to stop, and it did not answer within 0.3 s of that"));
    }
  }
}

}  // namespace
}  // namespace relign::cli_test
