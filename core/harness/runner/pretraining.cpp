#include "runner/pretraining.h"

#include <chrono>
#include <ctime>
#include <utility>

#include "base/hash.h"
#include "base/text.h"
#include "plugin_host/training.h"
#include "runner/pretraining_store.h"
#include "runner/provenance.h"

namespace relign::runner {
namespace {

// Part of every key: increase it when pretraining with the same key would give other data.
constexpr int kPretrainingVersion = 1;
// A constant, because pretraining does not depend on the suite.
constexpr std::uint64_t kPretrainingSeed = 0;

Json identity_json(const std::string& identity) {
  Json parsed = parsed_json(identity);
  return parsed.is_discarded() ? Json(identity) : parsed;
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

std::string place_of(const TrialJob& job) {
  return job.scene_name + ", " + job.level_name + ", " + trials::protocol_name(job.protocol);
}

void check_pretraining_stop(const std::atomic<bool>* stop) {
  if (stop && stop->load()) throw Error(ErrorKind::stopped, "stopped during pretraining");
}

}  // namespace

Pretrainer::Pretrainer(Options options) : options_(std::move(options)) {}
Pretrainer::~Pretrainer() = default;

const Pretrainer::Entries& Pretrainer::prepare(const TrialJob& job, const std::string& scene_data) {
  const std::string key = canonical_json(key_of(job.algorithm, job, scene_data));
  if (const auto known = answers_.find(key); known != answers_.end()) return known->second;
  Entries entries;
  if (!job.facts.owns_stage) prepare_one(job.algorithm, job, scene_data, entries);
  return answers_[key] = std::move(entries);
}

// Inner algorithms first, because the outer one may run them during its pretraining.
void Pretrainer::prepare_one(const plugin_host::Choice& algorithm, const TrialJob& job, const std::string& scene_data,
                             Entries& entries) {
  for (const auto& [parameter, inner] : algorithm.algorithms) prepare_one(*inner, job, scene_data, entries);
  const auto wanted = plugin_host::pretraining(*algorithm.plugin, algorithm.parameters);
  if (!wanted) return;
  Json key = key_of(algorithm, job, scene_data);
  // Data of an ordinary run may contain what the algorithm should not have seen.
  if (options_.sandbox) key["sandbox"] = true;
  PretrainingEntry& entry = finished_[canonical_json(key)];
  if (entry.algorithm.empty()) entry = make(algorithm, job, key, entries);
  entries[algorithm.identity] = entry;
}

PretrainingEntry Pretrainer::make(const plugin_host::Choice& algorithm, const TrialJob& job, const Json& key,
                                  const Entries& inner) {
  const auto report = [this](const std::string& message) {
    if (options_.on_message) options_.on_message(message);
  };
  const auto wanted = *plugin_host::pretraining(*algorithm.plugin, algorithm.parameters);
  const PretrainingStore store(options_.cache_folder, algorithm.plugin->id, key);
  PretrainingEntry entry;
  entry.algorithm = algorithm.plugin->id;
  entry.sources = wanted.sources;
  entry.steps = wanted.steps;
  entry.file = store.data_file();
  if (!options_.again) {
    std::string problem;
    entry.data = store.read(problem);
    if (entry.data.bytes) return entry;
    if (!problem.empty())
      report("pretrained data of " + entry.algorithm + ": " + problem + "; repeating the pretraining");
  }

  report("pretraining " + entry.algorithm + " for " + place_of(job) + ": " + std::to_string(wanted.sources) +
         (wanted.sources == 1 ? " source" : " sources") + " of " + std::to_string(wanted.steps) +
         " steps, stored for later runs");
  if (!runner_)
    runner_ = std::make_unique<TrialRunner>(TrialRunner::Options{.threads = options_.threads,
                                                                 .cache_folder = options_.cache_folder,
                                                                 .on_message = options_.on_message,
                                                                 .stop = options_.stop,
                                                                 .sandbox = options_.sandbox});
  const auto begin = std::chrono::steady_clock::now();
  trials::PretrainingState state;
  state.sources = wanted.sources;
  TrialJob source = job;
  source.id.clear();
  source.algorithm = algorithm;
  source.algorithm_name = algorithm.plugin->id;  // seeds do not depend on the name in a suite
  source.budget = wanted.steps;
  source.seeds = {kPretrainingSeed, kPretrainingSeed};
  source.pretraining = &state;
  source.prepared = data_of(inner);
  for (state.source = 0; state.source < wanted.sources; ++state.source) {
    check_pretraining_stop(options_.stop);
    source.instance = state.source;
    const TrialOutcome outcome = runner_->run(source, options_.stop);
    check_pretraining_stop(options_.stop);
    if (options_.on_source) options_.on_source();
    if (!outcome.stopped && !records::ended_well(outcome.record.end)) {
      entry.data.failure = "pretraining " + entry.algorithm + " failed on source " + std::to_string(state.source) +
                           ": " + outcome.record.message;
      return entry;
    }
  }
  entry.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!state.bytes) {
    entry.data.failure = "pretraining " + entry.algorithm + " failed: it saved no data on any source";
    return entry;
  }
  entry.made_now = true;
  entry.data.bytes = state.bytes;
  entry.data.hash = sha256_hex(*state.bytes);
  try {
    store.write(entry.data, {{"sources", wanted.sources},
                             {"steps", wanted.steps},
                             {"seconds", entry.seconds},
                             {"at", utc_now()},
                             {"program", RELIGN_VERSION},
                             {"scene_name", job.scene_name},
                             {"noise_level_name", job.level_name}});
  } catch (const Error& error) {
    report("cannot store the pretrained data of " + entry.algorithm + ": " + error.what());
    entry.file.clear();
  }
  return entry;
}

const std::string& Pretrainer::hash_of(const plugin_host::Choice& choice) {
  std::string& hash = hashes_[choice.plugin->library.string()];
  if (hash.empty()) hash = plugin_host::plugin_hash(*choice.plugin);
  return hash;
}

Json Pretrainer::key_of(const plugin_host::Choice& algorithm, const TrialJob& job, const std::string& scene_data) {
  const std::function<Json(const plugin_host::Choice&)> identified = [&](const plugin_host::Choice& choice) {
    Json entry = {{"hash", hash_of(choice)}, {"identity", identity_json(choice.identity)}};
    for (const auto& [parameter, inner] : choice.algorithms) entry["runs"][parameter] = identified(*inner);
    return entry;
  };
  Json key = {{"pretraining", kPretrainingVersion},
              {"algorithm", identified(algorithm)},
              {"scene", identified(job.scene)},
              {"scene_data", identity_json(scene_data)},
              {"noise_level", identified(job.level)},
              {"protocol", trials::protocol_name(job.protocol)},
              {"merit", trials::merit_name(job.merit)},
              {"limits", job.limits == trials::Limits::hard ? "hard" : "soft"},
              {"machine_time", json_of(keys_of(job.machine_time))}};
  if (job.merit == trials::Merit::mtf && job.mtf_limits.limits_anything())
    key["merit_limits"] = {job.mtf_limits.lp_per_mm, job.mtf_limits.centre, job.mtf_limits.corner};
  return key;
}

Json to_json(const Pretrainer::Entries& entries) {
  Json list = Json::array();
  for (const auto& [identity, entry] : entries)
    list.push_back({{"identity", identity},
                    {"algorithm", entry.algorithm},
                    {"bytes", entry.data.bytes ? Json(to_hex(*entry.data.bytes)) : Json(nullptr)},
                    {"hash", entry.data.hash},
                    {"failure", entry.data.failure},
                    {"sources", entry.sources},
                    {"steps", entry.steps},
                    {"made_now", entry.made_now},
                    {"seconds", entry.seconds},
                    {"file", entry.file.string()}});
  return list;
}

Pretrainer::Entries entries_from_json(const Json& json) {
  Pretrainer::Entries entries;
  for (const Json& one : json) {
    PretrainingEntry& entry = entries[one.at("identity").get<std::string>()];
    entry.algorithm = one.at("algorithm").get<std::string>();
    if (const Json& bytes = one.at("bytes"); !bytes.is_null())
      entry.data.bytes = std::make_shared<const std::string>(from_hex(bytes.get_ref<const std::string&>()));
    entry.data.hash = one.at("hash").get<std::string>();
    entry.data.failure = one.at("failure").get<std::string>();
    entry.sources = one.at("sources").get<unsigned>();
    entry.steps = one.at("steps").get<unsigned>();
    entry.made_now = one.at("made_now").get<bool>();
    entry.seconds = one.at("seconds").get<double>();
    entry.file = one.at("file").get<std::string>();
  }
  return entries;
}

Pretrainer::Entries without_data(const plugin_host::Choice& algorithm, const std::string& failure) {
  Pretrainer::Entries entries;
  for (const auto& [parameter, inner] : algorithm.algorithms) entries.merge(without_data(*inner, failure));
  if (const auto wanted = plugin_host::pretraining(*algorithm.plugin, algorithm.parameters)) {
    PretrainingEntry& entry = entries[algorithm.identity];
    entry.algorithm = algorithm.plugin->id;
    entry.sources = wanted->sources;
    entry.steps = wanted->steps;
    entry.data.failure = "pretraining " + entry.algorithm + " failed: " + failure;
  }
  return entries;
}

std::shared_ptr<const trials::PreparedByIdentity> data_of(const Pretrainer::Entries& entries) {
  if (entries.empty()) return nullptr;
  auto data = std::make_shared<trials::PreparedByIdentity>();
  for (const auto& [identity, entry] : entries) (*data)[identity] = entry.data;
  return data;
}

std::string hash_of(const Pretrainer::Entries& entries) {
  std::string hashes;
  for (const auto& [identity, entry] : entries) hashes += entry.data.hash;
  return entries.size() > 1 ? sha256_hex(hashes) : hashes;
}

}  // namespace relign::runner
