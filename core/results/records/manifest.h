// manifest.json of a results folder: suite, plugins, program and machine of a run (results/README.md). The structs
// declare its members; writer, reader, comparison of folders, JSON Schema and the tables of documents follow from them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/described.h"
#include "base/scene_score.h"
#include "base/suite_terms.h"
#include "records/difference.h"

namespace relign {

template <>
struct JsonForm<records::Difference> {
  static Json write(const records::Difference& difference);
  static void read(const Member& member, const Json& json, records::Difference& difference, JsonFlaws& flaws);
  static bool left_out(const records::Difference&) { return false; }
};

}  // namespace relign

namespace relign::records {

inline constexpr std::string_view kSha256 = "^[0-9a-f]{64}$", kShortHash = "^[0-9a-f]{16}$";

// The relign-bench that wrote this.
struct Program {
  std::string version, compiler, flags, hash;  // hash: "" if unknown

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"version"}, s.version...);
    visit(Member{"compiler"}, s.compiler...);
    visit(Member{"flags"}, s.flags...);
    visit(Member{.key = "hash", .meaning = "SHA-256 of the program", .pattern = "^([0-9a-f]{64})?$"}, s.hash...);
  }
  bool operator==(const Program&) const = default;
};

// Where it ran.
struct Machine {
  std::string cpu, instruction_sets;
  unsigned cores = 1;
  std::string system;
  std::map<std::string, std::uint64_t> scene_memory_bytes;

  // Whether plugins that are reproducible only on one processor give the same numbers on both: compares instruction
  // sets, or the processors' names where one of them states none.
  bool same_processor(const Machine& other) const;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"cpu"}, s.cpu...);
    visit(Member{"instruction_sets",
                 "maker and instruction sets: where they are equal, \"this_cpu\" plugins give equal numbers", kLeftOut},
          s.instruction_sets...);
    visit(Member{.key = "cores", .least = 1}, s.cores...);
    visit(Member{"system"}, s.system...);
    visit(Member{"scene_memory_bytes",
                 "by scene: the most memory that the program had while it created the scene, 0 if unknown; absent from "
                 "shards of a frozen plan",
                 kLeftOut},
          s.scene_memory_bytes...);
  }
  bool operator==(const Machine&) const = default;
};

// A method may be in a list under both protocols.
inline std::string method_key(const std::string& name, const std::string& protocol) { return name + "\n" + protocol; }

// Null if no entry of a list has this key.
template <class Entry>
const Entry* entry_with_key(const std::vector<Entry>& entries, const std::string& key) {
  for (const Entry& entry : entries)
    if (entry.key() == key) return &entry;
  return nullptr;
}

// A scene, noise level or method of the suite.
struct PluginEntry {
  std::string name, id, plugin, kind = "scene";
  Json parameters = Json::object();
  std::string summary, reproducible = "anywhere", plugin_hash;

  bool on_this_cpu_only() const { return reproducible == "this_cpu"; }
  std::string key() const { return name; }  // unique in its list

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"name", "name shown"}, s.name...);
    visit(Member{"id", "id, preset or path"}, s.id...);
    visit(Member{"plugin", "id"}, s.plugin...);
    visit(Member{.key = "kind", .one_of = "scene noise-level optimizer agent"}, s.kind...);
    visit(Member{"parameters", "all, defaults among them; files by name and content", kAnyObject}, s.parameters...);
    visit(Member{"summary"}, s.summary...);
    visit(Member{.key = "reproducible", .one_of = "anywhere this_cpu"}, s.reproducible...);
    visit(Member{"plugin_hash", "SHA-256 of library and manifest"}, s.plugin_hash...);
  }
};

struct ManifestScene : PluginEntry {
  Json identity, data;
  std::string folder;
  MachineTimeKeys machine_time;
  Json spec;
  SceneScore score;
  bool owns_stage = false, truth = true, replayable = true;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    PluginEntry::members(visit, s...);
    visit(Member{"identity", "what makes it this one and no other"}, s.identity...);
    visit(Member{"data", "hashes of the scene's data files"}, s.data...);
    visit(Member{"folder", "in the results folder"}, s.folder...);
    visit(Member{"machine_time"}, s.machine_time...);
    visit(Member{"spec", "the scene's own", kAnyObject | kMayBeNull}, s.spec...);
    visit(Member{"score", "what its poses are judged by; absent for the RMSE", kLeftOut}, s.score...);
    visit(Member{"owns_stage", "a station"}, s.owns_stage...);
    visit(Member{"truth", "observes noise-free errors"}, s.truth...);
    visit(Member{"replayable"}, s.replayable...);
  }
};

struct ManifestLevel : PluginEntry {
  Json identity;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    PluginEntry::members(visit, s...);
    visit(Member{"identity", "what makes it this one and no other"}, s.identity...);
  }
};

struct ManifestMethod : PluginEntry {
  // Which training of which list of the suite it is.
  struct OfList {
    std::string method, training;

    template <class Visit, class... S>
    static void members(Visit&& visit, S&... s) {
      visit(Member{"method"}, s.method...);
      visit(Member{"training"}, s.training...);
    }
    bool operator==(const OfList&) const = default;
  };
  // What learning outside the benchmark has cost; NaN: unknown.
  struct Training {
    double hours = std::numeric_limits<double>::quiet_NaN(), steps = hours;
    std::string machine;

    template <class Visit, class... S>
    static void members(Visit&& visit, S&... s) {
      visit(Member{.key = "hours", .flags = kMayBeNull, .least = 0}, s.hours...);
      visit(Member{.key = "steps", .meaning = "images looked at", .flags = kMayBeNull, .least = 0}, s.steps...);
      visit(Member{"machine"}, s.machine...);
    }
  };

  std::vector<std::string> observes;
  bool oracle = false;
  std::string protocol = "paper", merit;
  unsigned steps = 0;
  bool added = false;
  std::optional<OfList> of_list;
  std::optional<Training> training;

  std::string key() const { return method_key(name, protocol); }
  // In the suite: of a method with several trainings that of their list.
  const std::string& listed_name() const { return of_list ? of_list->method : name; }
  // "'compass' (protocol paper)", for messages.
  std::string label() const { return "'" + name + "' (protocol " + protocol + ")"; }

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    PluginEntry::members(visit, s...);
    visit(Member{"observes"}, s.observes...);
    visit(Member{"oracle", "has information that its protocol does not grant"}, s.oracle...);
    visit(Member{.key = "protocol", .one_of = "paper blind"}, s.protocol...);
    visit(Member{"merit"}, s.merit...);
    visit(Member{"steps"}, s.steps...);
    visit(Member{"added", "home and random, when the suite did not name them"}, s.added...);
    visit(Member{"of_list", "which training of which list of the suite this is; absent elsewhere", kLeftOut},
          s.of_list...);
    visit(Member{"training", "what learning outside the benchmark has cost; absent where nothing was learnt", kLeftOut},
          s.training...);
  }
};

// Pretraining of an algorithm on source instances.
struct Pretrained {
  std::string scene, noise_level, algorithm, protocol = "paper", plugin;
  unsigned sources = 0, steps = 0;
  std::string sha256, failure;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"scene"}, s.scene...);
    visit(Member{"noise_level"}, s.noise_level...);
    visit(Member{"algorithm"}, s.algorithm...);
    visit(Member{.key = "protocol", .one_of = "paper blind"}, s.protocol...);
    visit(Member{"plugin"}, s.plugin...);
    visit(Member{"sources"}, s.sources...);
    visit(Member{"steps"}, s.steps...);
    visit(Member{"sha256"}, s.sha256...);
    visit(Member{"failure"}, s.failure...);
  }
  bool operator==(const Pretrained&) const = default;
};

// Which shard of a plan.
struct Shard {
  std::uint64_t number = 0, of = 1;
  std::string plan;  // its hash
  std::uint64_t plan_trials = 0;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"number"}, s.number...);
    visit(Member{.key = "of", .least = 1}, s.of...);
    visit(Member{.key = "plan", .meaning = "hash of the plan", .pattern = kShortHash}, s.plan...);
    visit(Member{"plan_trials"}, s.plan_trials...);
  }
};

// Of algorithms in a run with --sandbox.
struct SandboxLimits {
  std::uint64_t memory_bytes = 0, processes = 1, disk_bytes = 0;
  std::vector<std::string> shown;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"memory_bytes", "0: no limit"}, s.memory_bytes...);
    visit(Member{.key = "processes", .least = 1}, s.processes...);
    visit(Member{"disk_bytes"}, s.disk_bytes...);
    visit(Member{"shown"}, s.shown...);
  }
};

// The text of a suite, verbatim, with the name and file that it had.
struct StoredSuite {
  std::string name, file, text;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"name"}, s.name...);
    visit(Member{"file"}, s.file...);
    visit(Member{"text"}, s.text...);
  }
  bool operator==(const StoredSuite&) const = default;
};

// Of the plugins of a merged folder, by name in the suite.
struct PluginHashesOfFolder {
  std::map<std::string, std::string> scenes, noise_levels, algorithms;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"scenes", "SHA-256", kLeftOut}, s.scenes...);
    visit(Member{"noise_levels", "SHA-256", kLeftOut}, s.noise_levels...);
    visit(Member{"algorithms", "SHA-256", kLeftOut}, s.algorithms...);
  }
};

// A folder that was merged.
struct MergeSource {
  std::string folder;
  std::uint64_t trials = 0;  // of the merged ones
  std::uint64_t suite = 0;   // place in Manifest::suites
  Program program;
  std::vector<Program> earlier_programs;
  Machine machine;
  std::string command;
  PluginHashesOfFolder plugins;
  std::optional<Shard> shard;
  std::optional<SandboxLimits> sandbox;
  std::string by_way_of;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"folder"}, s.folder...);
    visit(Member{"trials", "of the merged ones", kMayLack}, s.trials...);
    visit(Member{"suite", "place in suites"}, s.suite...);
    visit(Member{"program"}, s.program...);
    visit(Member{"earlier_programs", "other builds that recorded trials of the folder", kLeftOut},
          s.earlier_programs...);
    visit(Member{"machine"}, s.machine...);
    visit(Member{"command"}, s.command...);
    visit(Member{"plugins", "", kMayLack}, s.plugins...);
    visit(Member{"shard", "", kLeftOut}, s.shard...);
    visit(Member{"sandbox", "", kLeftOut}, s.sandbox...);
    visit(Member{"by_way_of", "the merged folder that it came in", kLeftOut}, s.by_way_of...);
  }
};

// The difference of two records of a trial, as a manifest keeps it.
struct StatedDifference {
  std::string line = "step";
  std::optional<unsigned> step;
  std::string field, kept, other;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{.key = "line", .one_of = "step closing"}, s.line...);
    visit(Member{"step", "", kLeftOut}, s.step...);
    visit(Member{"field"}, s.field...);
    visit(Member{"kept", "value"}, s.kept...);
    visit(Member{"other", "value"}, s.other...);
  }
};

// A trial whose records differ between two folders. The merged folder has the one of `kept`.
struct Disagreement {
  std::string trial, label;  // label: "compass on relign_od rho0.25 #3"
  std::string kept, other;   // folders
  Difference difference;     // was: kept, is: other

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{.key = "trial", .pattern = kShortHash}, s.trial...);
    visit(Member{"label"}, s.label...);
    visit(Member{"kept", "folder"}, s.kept...);
    visit(Member{"other", "folder"}, s.other...);
    visit(Member{"difference"}, s.difference...);
  }
};

// How folders were joined.
struct MergeSummary {
  std::size_t trials = 0;            // complete ones in the merged folder
  std::size_t missing = 0;           // planned by a source, complete in none
  std::size_t duplicates = 0;        // further records of a trial that agree with the first
  std::size_t within_tolerance = 0;  // of these: from another processor, equal only within kOtherCpuTolerance
  NotCompared not_compared;          // of duplicates: columns that one of the two builds did not have yet
  std::size_t superseded = 0;        // records of failed attempts at a trial that another folder has finished
  std::size_t half_written = 0;      // trials with steps but no closing line
  std::size_t left_out = 0;          // of an earlier version of a source's suite
  std::size_t disagreeing = 0;       // trials; `disagreements` has the first kNamedDisagreements of them
  std::vector<Disagreement> disagreements;
  unsigned shards = 0;  // of the plan that all sources share; 0: none, or several
  std::optional<std::vector<unsigned>> missing_shards;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"trials"}, s.trials...);
    visit(Member{"missing"}, s.missing...);
    visit(Member{"duplicates"}, s.duplicates...);
    visit(Member{"within_tolerance"}, s.within_tolerance...);
    visit(Member{"not_compared", "number of trials by column that their build did not have", kMayLack},
          s.not_compared...);
    visit(Member{"superseded"}, s.superseded...);
    visit(Member{"half_written"}, s.half_written...);
    visit(Member{"left_out"}, s.left_out...);
    visit(Member{"disagreeing"}, s.disagreeing...);
    visit(Member{"disagreements"}, s.disagreements...);
    visit(Member{"shards", "", kLeftOut}, s.shards...);
    visit(Member{"missing_shards", "", kLeftOut}, s.missing_shards...);
  }
};
inline constexpr std::size_t kNamedDisagreements = 1000;

struct Manifest {
  unsigned format = 1;
  Program program;
  std::vector<Program> earlier_programs;
  std::string suite, suite_file, suite_name;
  std::uint64_t seed = 0;
  std::string commitment, secret;
  std::uint64_t first_instance = 0, instances = 0;
  std::string limits = "soft";
  std::string instance_set;
  Machine machine;
  std::vector<ManifestScene> scenes;
  std::vector<ManifestLevel> noise_levels;
  std::vector<ManifestMethod> algorithms;
  std::vector<Pretrained> prepared;
  std::uint64_t trials = 0;
  std::vector<std::string> order;
  std::optional<AnalysisPlan> analysis;
  std::string analysis_hash, analysis_began_with;
  std::string command;
  Json spec;
  std::optional<Prices> cost;
  std::optional<CycleTimes> cycle;
  std::vector<double> targets;
  MachineTimeKeys machine_time;
  std::optional<Shard> shard;
  std::optional<SandboxLimits> sandbox;
  std::vector<MergeSource> sources;
  std::vector<StoredSuite> suites;
  std::optional<MergeSummary> merge;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{.key = "format", .meaning = "of the file; readers refuse newer ones", .least = 1, .most = 1},
          s.format...);
    visit(Member{"program", "the relign-bench that wrote this"}, s.program...);
    visit(Member{"earlier_programs", "other builds that recorded trials of the folder", kLeftOut},
          s.earlier_programs...);
    visit(Member{"suite", "its text, verbatim"}, s.suite...);
    visit(Member{"suite_file", "its path"}, s.suite_file...);
    visit(Member{"suite_name", "its name"}, s.suite_name...);
    visit(Member{"seed", "of the suite"}, s.seed...);
    visit(
        Member{
            .key = "commitment", .meaning = "of a sealed suite", .flags = kLeftOut, .pattern = "^sha256:[0-9a-f]{64}$"},
        s.commitment...);
    visit(Member{.key = "secret",
                 .meaning = "of a sealed suite, once relign-bench unseal published it",
                 .flags = kLeftOut,
                 .pattern = kSha256},
          s.secret...);
    visit(Member{"first_instance", "its number"}, s.first_instance...);
    visit(Member{"instances", "of each scene and noise level"}, s.instances...);
    visit(Member{.key = "limits", .meaning = "of the stage, by the suite", .one_of = "soft hard"}, s.limits...);
    visit(Member{.key = "instance_set", .meaning = "hash of all instances", .pattern = kShortHash}, s.instance_set...);
    visit(Member{"machine", "where it ran"}, s.machine...);
    visit(Member{"scenes", "of the suite"}, s.scenes...);
    visit(Member{"noise_levels", "of the suite"}, s.noise_levels...);
    visit(Member{"algorithms", "methods of the suite, and those that the program added"}, s.algorithms...);
    visit(Member{"prepared", "pretraining of the algorithms"}, s.prepared...);
    visit(Member{"trials", "planned"}, s.trials...);
    visit(Member{.key = "order", .meaning = "trials in the plan's order", .pattern = kShortHash}, s.order...);
    visit(Member{"analysis", "the suite's analysis plan with its defaults; absent without one", kLeftOut},
          s.analysis...);
    visit(Member{.key = "analysis_hash",
                 .meaning = "SHA-256 of analysis as canonical JSON",
                 .flags = kLeftOut,
                 .pattern = kSha256},
          s.analysis_hash...);
    visit(Member{.key = "analysis_began_with",
                 .meaning = "hash of the plan with which the first trials were made, where it is another one; none: "
                            "there was no plan",
                 .flags = kLeftOut,
                 .pattern = "^(none|[0-9a-f]{64})$"},
          s.analysis_began_with...);
    visit(Member{"command", "which repeats the run"}, s.command...);
    visit(Member{.key = "spec",
                 .meaning = "the suite's specification",
                 .flags = kAnyObject | kMayBeNull,
                 .schema = "spec.schema.json"},
          s.spec...);
    visit(Member{"cost", "the suite's prices; absent without them", kLeftOut}, s.cost...);
    visit(Member{"cycle", "the suite's, of times of a module's cycle besides alignment; absent without one", kLeftOut},
          s.cycle...);
    visit(Member{"targets", "of the suite"}, s.targets...);
    visit(Member{"machine_time", "what the suite sets over the scenes'"}, s.machine_time...);
    visit(Member{"shard", "of a plan, which the folder is", kLeftOut}, s.shard...);
    visit(Member{"sandbox", "limits of the algorithms, of a run with --sandbox", kLeftOut}, s.sandbox...);
    visit(Member{"sources", "folders of which this one was merged", kLeftOut}, s.sources...);
    visit(Member{"suites", "the different suites of a merged folder", kLeftOut}, s.suites...);
    visit(Member{"merge", "how folders were joined; numbers of trials", kLeftOut}, s.merge...);
  }

  const ManifestScene* scene(const std::string& name) const { return entry_with_key(scenes, name); }
  const ManifestMethod* method(const std::string& name, const std::string& protocol) const {
    return entry_with_key(algorithms, method_key(name, protocol));
  }
  bool sealed() const { return !commitment.empty(); }
  // Those of a merged folder, else its own.
  std::vector<StoredSuite> stored_suites() const;
  // Whether it has the text of every suite, so that it could be compared with it (is_suite).
  bool has_suites() const;
  // The machines of the folder, or of those that it was merged from.
  std::vector<const Machine*> machines() const;
  // The programs of every build that recorded trials, each once.
  std::vector<Program> builds() const;
  // "results from 2 builds of relign-bench"; empty if they are from one.
  std::string builds_note() const;
  // Whether algorithms of the folder, or of one that it was merged from, ran in a sandbox.
  bool ran_in_sandbox() const;
};

// Whether JSON has what every suite has: scenes, noise levels and methods.
bool is_suite(const Json& suite);

// manifest.json of a folder; nothing when there is none. Throws Error(bad_input) for a file that is damaged, lacks a
// member or has an unknown one, and NewerFormat.
std::optional<Manifest> read_manifest(const std::filesystem::path& folder);
// The same; throws Error(bad_input) when there is none.
Manifest manifest_of(const std::filesystem::path& folder);
// The file as it is, for hashes.
Json read_manifest_json(const std::filesystem::path& folder);

}  // namespace relign::records
