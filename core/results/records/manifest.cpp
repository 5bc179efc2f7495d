#include "records/manifest.h"

#include <algorithm>

#include "base/error.h"
#include "base/json_members.h"
#include "records/record.h"

namespace relign {

using records::Difference;
using records::StatedDifference;

Json JsonForm<Difference>::write(const Difference& difference) {
  const auto& [closing, step, field, was, is, size] = difference;
  return json_of(
      StatedDifference{closing ? "closing" : "step", closing ? std::nullopt : std::optional(step), field, was, is});
}

void JsonForm<Difference>::read(const Member& member, const Json& json, Difference& difference, JsonFlaws& flaws) {
  StatedDifference stated;
  JsonForm<StatedDifference>::read(member, json, stated, flaws);
  difference = {stated.line == "closing", stated.step.value_or(0), stated.field, stated.kept, stated.other, 0};
}

}  // namespace relign

namespace relign::records {
namespace fs = std::filesystem;

namespace {

constexpr const char* kFile = "manifest.json";

}  // namespace

bool is_suite(const Json& suite) {
  return !list_of(suite, "scenes").empty() && !list_of(suite, "noise_levels").empty() &&
         !list_of(suite, "algorithms").empty();
}

bool Machine::same_processor(const Machine& other) const {
  return instruction_sets.empty() || other.instruction_sets.empty() ? cpu == other.cpu
                                                                    : instruction_sets == other.instruction_sets;
}

std::vector<StoredSuite> Manifest::stored_suites() const {
  return suites.empty() ? std::vector<StoredSuite>{{suite_name, suite_file, suite}} : suites;
}

bool Manifest::has_suites() const {
  const std::vector<StoredSuite> stored = stored_suites();
  return std::all_of(stored.begin(), stored.end(),
                     [](const StoredSuite& one) { return is_suite(parsed_json(one.text)); });
}

std::vector<const Machine*> Manifest::machines() const {
  if (sources.empty()) return {&machine};
  std::vector<const Machine*> all;
  for (const MergeSource& source : sources) all.push_back(&source.machine);
  return all;
}

std::vector<Program> Manifest::builds() const {
  std::vector<Program> all;
  std::set<std::string> hashes;
  const auto add = [&](const Program& one, const std::vector<Program>& earlier) {
    if (hashes.insert(one.hash).second) all.push_back(one);
    for (const Program& other : earlier)
      if (hashes.insert(other.hash).second) all.push_back(other);
  };
  if (sources.empty()) add(program, earlier_programs);
  for (const MergeSource& source : sources) add(source.program, source.earlier_programs);
  return all;
}

std::string Manifest::builds_note() const {
  const std::size_t count = builds().size();
  return count > 1 ? "results from " + std::to_string(count) + " builds of relign-bench" : "";
}

bool Manifest::ran_in_sandbox() const {
  return sandbox || std::any_of(sources.begin(), sources.end(), [](const MergeSource& one) { return one.sandbox; });
}

Json read_manifest_json(const fs::path& folder) { return read_formatted(folder / kFile); }

std::optional<Manifest> read_manifest(const fs::path& folder) {
  const Json json = read_manifest_json(folder);
  if (json.is_null()) return std::nullopt;
  return read_described<Manifest>(json, (folder / kFile).string());
}

Manifest manifest_of(const fs::path& folder) {
  std::optional<Manifest> manifest = read_manifest(folder);
  if (!manifest)
    throw Error(ErrorKind::bad_input, folder.string() + " is not a results folder: it has no manifest.json");
  return std::move(*manifest);
}

}  // namespace relign::records
