// Prepares algorithms whose manifest declares "prepare": conversations on source instances, whose seeds belong to a
// domain of their own (base/seeds.h), so that no source is the instance of any trial. Deterministic: the seeds are the
// same whoever prepares, whatever the suite, and what the cache has lost is made anew as it was.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "runner/trial_runner.h"
#include "trials/prepared_service.h"

namespace relign::runner {

// What was prepared for one algorithm, for whoever shows or records it.
struct PreparedEntry {
  std::string algorithm;  // plugin's id
  trials::PreparedData data;
  unsigned sources = 0, steps = 0;
  bool made_now = false;
  double seconds = 0;          // of making it
  std::filesystem::path file;  // empty: not kept
};

class Preparer {
 public:
  struct Options {
    unsigned threads = 1;                                // for the scene's own work
    std::filesystem::path cache_folder;                  // empty: nothing is kept beyond this object
    std::function<void(const std::string&)> on_message;  // "transfer-gp is being prepared ...", warnings
    std::function<void()> on_source;                     // one more source is done
    const std::atomic<bool>* stop = nullptr;
    bool again = false;  // makes anew what is there
  };
  explicit Preparer(Options options);
  ~Preparer();

  // Everything that the job's algorithm and those it runs load, by Choice::identity: from the cache, else made now.
  // Those that are never prepared are left out, all of them on a station, where nothing can be drawn. What fails is in
  // PreparedData::failure. scene_data: data_identity of the job's scene. Throws Error(stopped) once `stop` is up, and
  // what concerns more than this algorithm (a scene that cannot be made).
  using Entries = std::map<std::string, PreparedEntry>;
  const Entries& prepare(const TrialJob& job, const std::string& scene_data);

 private:
  void prepare_one(const plugin_host::Choice& algorithm, const TrialJob& job, const std::string& scene_data,
                   Entries& entries);
  PreparedEntry make(const plugin_host::Choice& algorithm, const TrialJob& job, const Json& key, const Entries& inner);
  const std::string& hash_of(const plugin_host::Choice& choice);
  Json key_of(const plugin_host::Choice& algorithm, const TrialJob& job, const std::string& scene_data);

  Options options_;
  std::unique_ptr<TrialRunner> runner_;            // made when something must be prepared
  std::map<std::string, std::string> hashes_;      // of plugins, by path
  std::map<std::string, PreparedEntry> finished_;  // by key
  std::map<std::string, Entries> answers_;         // by everything that was asked
};

// From one process to another.
Json to_json(const Preparer::Entries& entries);
Preparer::Entries entries_from_json(const Json& json);  // throws Json::exception and Error
// What is left when preparing `algorithm` came to no end.
Preparer::Entries without_data(const plugin_host::Choice& algorithm, const std::string& failure);

// The data alone, as trials take it; null when there is none.
std::shared_ptr<const trials::PreparedByIdentity> data_of(const Preparer::Entries& entries);
// One hash of all that a trial may load; empty when it may load nothing.
std::string hash_of(const Preparer::Entries& entries);

}  // namespace relign::runner
