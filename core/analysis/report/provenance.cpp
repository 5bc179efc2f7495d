#include "report/provenance.h"

#include "base/text.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxDisagreementsNamed = 20;

std::string disagreement(const records::Disagreement& one) {
  const records::Difference& difference = one.difference;
  return one.label + ": " + (difference.closing ? "the closing line" : "step " + std::to_string(difference.step)) +
         ", " + difference.field + " is " + difference.was + " in " + one.kept + ", " + difference.is + " in " +
         one.other;
}

void add_merge(Provenance& made, const records::Manifest& manifest) {
  for (const records::MergeSource& source : manifest.sources)
    made.sources.push_back({source.folder, source.trials, source.machine.cpu, source.program.hash});
  made.merge = manifest.merge;
  if (!made.merge) return;
  made.disagreeing = made.merge->disagreeing;
  for (const records::Disagreement& one : made.merge->disagreements)
    if (made.disagreements.size() < kMaxDisagreementsNamed) made.disagreements.push_back(disagreement(one));
}

std::string seed_fact(const records::Manifest& manifest) {
  if (!manifest.sealed()) return std::to_string(manifest.seed);
  return "sealed, commitment " + manifest.commitment +
         (manifest.secret.empty() ? "" : "; secret, published since: " + manifest.secret);
}

}  // namespace

Provenance provenance_of(const records::Manifest& manifest) {
  Provenance made;
  made.suite_name = manifest.suite_name;
  made.suite_file = manifest.suite_file;
  made.suite_text = manifest.suite;
  made.seed = std::to_string(manifest.seed);
  made.instance_set = manifest.instance_set;
  made.command = manifest.command;
  made.program = manifest.program;
  made.machine = manifest.machine;
  made.facts = {{"program", "relign-bench " + made.program.version},
                {"program hash", made.program.hash},
                {"compiler", made.program.compiler},
                {"flags", made.program.flags},
                {"processor", made.machine.cpu},
                {"cores", std::to_string(made.machine.cores)},
                {"system", made.machine.system},
                {"suite file", made.suite_file},
                {"suite seed", seed_fact(manifest)},
                {"instance set", made.instance_set}};
  std::string memory;
  for (const auto& [scene, bytes] : made.machine.scene_memory_bytes)
    if (bytes > 0)
      memory += (memory.empty() ? "" : ", ") + scene + " " + significant(static_cast<double>(bytes) / 1e6, 3) + " MB";
  if (!memory.empty()) made.facts.push_back({"memory to create scenes", memory});
  if (const std::string note = manifest.builds_note(); !note.empty()) made.notes.push_back(note);
  if (!manifest.sources.empty()) add_merge(made, manifest);
  return made;
}

}  // namespace relign::report
