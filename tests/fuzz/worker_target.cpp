// What comes over the connection of a worker's process, into which a plugin may write, too.
#include "plugin_host/manifest.h"
#include "runner/worker_process.h"
#include "target.h"
#include "trials/scene_facts.h"

using namespace relign;

namespace {

plugin_host::Choice choice(plugin_host::Kind kind) {
  auto manifest = std::make_shared<plugin_host::Manifest>();
  manifest->id = "made";
  manifest->kind = kind;
  manifest->library = "/made.so";
  manifest->text = "{}";
  plugin_host::Choice made;
  made.plugin = manifest;
  made.id = "made";
  made.parameters = Json::object();
  made.identity = "{}";
  return made;
}

runner::PreparedPlan plan() {
  runner::PreparedPlan made;
  suites::Suite& suite = made.plan.suite;
  suite.scenes.push_back({"scene", choice(plugin_host::Kind::scene)});
  suite.levels.push_back({"level", choice(plugin_host::Kind::noise_level)});
  suites::AlgorithmEntry algorithm;
  algorithm.name = "algorithm";
  algorithm.choice = choice(plugin_host::Kind::optimizer);
  algorithm.protocol = "blind";
  suite.algorithms.push_back(algorithm);
  made.scenes.push_back(trials::read_scene_facts(R"({"name": "toy", "summary": "A scene.",
    "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1}], "nominal_pose": [0.5],
    "image": {"width": 4, "height": 3, "white": 1}, "elements": [],
    "machine_time": {"speed_mm_per_s": 5, "speed_deg_per_s": 5, "settle_ms": 40, "exposure_ms": 15, "readout_ms": 30}})",
                                                 "toy"));
  made.scene_identity = {"{}"};
  return made;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const runner::PreparedPlan prepared = plan();
  static const runner::LibraryHashes hashes = {{"/made.so", "00"}};
  const std::filesystem::path said = fuzz::scratch_folder() / "said";
  fuzz::write_scratch(said, fuzz::text_of(data, size));
  suites::PlannedTrial trial;
  trial.id = "0123456789abcdef";
  runner::ProcessWorker::Limits limits;
  limits.trial_seconds = 5;
  runner::WorkerOptions options;
  options.on_message = [](const std::string&) {};
  try {
    runner::ProcessWorker worker(prepared, hashes, {RELIGN_SAY, said.string()}, limits, options);
    const runner::WorkedTrial worked = worker.run(trial, nullptr);
    fuzz::demand(worked.record.end.size() > 0 || worked.stopped, "a trial with an end");
  } catch (const Error& error) {  // a worker that does not start, or reports what concerns more than its trial
    fuzz::demand(std::string(error.what()).size() > 0, "a sentence");
  }
  return 0;
}
