// Pretraining of algorithms whose manifest has "prepare": trials on source instances, whose seeds have a domain of
// their own (base/seeds.h), so that no source is an instance of a benchmark trial. Deterministic: the seeds do not
// depend on the suite, so that data lost from the cache are reproduced.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "runner/trial_runner.h"
#include "trials/pretraining.h"

namespace relign::runner {

// The pretrained data of one algorithm, with facts to show and record.
struct PretrainingEntry {
  std::string algorithm;  // plugin's id
  trials::PretrainingData data;
  unsigned sources = 0, steps = 0;
  bool made_now = false;
  double seconds = 0;          // duration of the pretraining
  std::filesystem::path file;  // empty: not stored
};

class Pretrainer {
 public:
  struct Options {
    unsigned threads = 1;                                // for the scene
    std::filesystem::path cache_folder;                  // empty: nothing is stored on disk
    std::function<void(const std::string&)> on_message;  // "pretraining transfer-gp ...", warnings
    std::function<void()> on_source;                     // called after each source
    const std::atomic<bool>* stop = nullptr;
    bool again = false;                                             // ignores stored data
    std::shared_ptr<const plugin_host::Sandbox> sandbox = nullptr;  // for algorithms; null: none
  };
  explicit Pretrainer(Options options);
  ~Pretrainer();

  // The data of the job's algorithm and of those that it runs, by Choice::identity: from the cache, or made now.
  // Without entries for algorithms that have no pretraining, and empty on a station, where instances cannot be drawn.
  // Failures are in PretrainingData::failure. scene_data: data_identity of the job's scene. Throws Error(stopped) once
  // `stop` is true, and other Errors that concern more than this algorithm (a scene that cannot be created).
  using Entries = std::map<std::string, PretrainingEntry>;
  const Entries& prepare(const TrialJob& job, const std::string& scene_data);

 private:
  void prepare_one(const plugin_host::Choice& algorithm, const TrialJob& job, const std::string& scene_data,
                   Entries& entries);
  PretrainingEntry make(const plugin_host::Choice& algorithm, const TrialJob& job, const Json& key,
                        const Entries& inner);
  const std::string& hash_of(const plugin_host::Choice& choice);
  Json key_of(const plugin_host::Choice& algorithm, const TrialJob& job, const std::string& scene_data);

  Options options_;
  std::unique_ptr<TrialRunner> runner_;               // created when needed
  std::map<std::string, std::string> hashes_;         // of plugins, by path
  std::map<std::string, PretrainingEntry> finished_;  // by key
  std::map<std::string, Entries> answers_;            // by the key of the job
};

// For messages between processes.
Json to_json(const Pretrainer::Entries& entries);
Pretrainer::Entries entries_from_json(const Json& json);  // throws Json::exception and Error
// Entries with `failure`, for pretraining of `algorithm` that did not end.
Pretrainer::Entries without_data(const plugin_host::Choice& algorithm, const std::string& failure);

// Only the data, as trials take it; null when there are none.
std::shared_ptr<const trials::PreparedByIdentity> data_of(const Pretrainer::Entries& entries);
// One hash of all data that a trial may load; empty when there are none.
std::string hash_of(const Pretrainer::Entries& entries);

}  // namespace relign::runner
