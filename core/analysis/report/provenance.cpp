#include "report/provenance.h"

#include "base/json_members.h"
#include "base/text.h"
#include "records/manifest_check.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxDisagreementsNamed = 20;

std::string disagreement(const Json& one) {
  const Json& difference = object_of(one, "difference");
  const bool closing = text_of(difference, "line") == "closing";
  return text_of(one, "label") + ": " + (closing ? "the closing line" : "step " + text_of(difference, "step")) + ", " +
         text_of(difference, "field") + " is " + text_of(difference, "kept") + " in " + text_of(one, "kept") + ", " +
         text_of(difference, "other") + " in " + text_of(one, "other");
}

void add_merge(Provenance& made, const Json& manifest) {
  for (const Json& source : list_of(manifest, "sources"))
    made.sources.push_back({text_of(source, "folder"), count_of(source, "trials"),
                            text_of(object_of(source, "machine"), "cpu"),
                            text_of(object_of(source, "program"), "hash")});
  made.merge = object_of(manifest, "merge");
  made.disagreeing = count_of(made.merge, "disagreeing");
  for (const Json& one : list_of(made.merge, "disagreements"))
    if (made.disagreements.size() < kMaxDisagreementsNamed) made.disagreements.push_back(disagreement(one));
}

std::string seed_fact(const Json& manifest) {
  const std::string commitment = text_of(manifest, "commitment"), secret = text_of(manifest, "secret");
  if (commitment.empty()) return text_of(manifest, "seed");
  return "sealed, commitment " + commitment + (secret.empty() ? "" : "; secret, published since: " + secret);
}

}  // namespace

Provenance provenance_of(const Json& manifest) {
  Provenance made;
  made.suite_name = text_of(manifest, "suite_name");
  made.suite_file = text_of(manifest, "suite_file");
  made.suite_text = text_of(manifest, "suite");
  made.seed = text_of(manifest, "seed");
  made.instance_set = text_of(manifest, "instance_set");
  for (const Json& word : list_of(manifest, "command"))
    if (word.is_string()) made.command += (made.command.empty() ? "" : " ") + word.get<std::string>();
  if (made.command.empty()) made.command = text_of(manifest, "command");
  made.program = object_of(manifest, "program");
  made.machine = object_of(manifest, "machine");
  made.facts = {{"program", "relign-bench " + text_of(made.program, "version")},
                {"program hash", text_of(made.program, "hash")},
                {"compiler", text_of(made.program, "compiler")},
                {"flags", text_of(made.program, "flags")},
                {"processor", text_of(made.machine, "cpu")},
                {"cores", text_of(made.machine, "cores")},
                {"system", text_of(made.machine, "system")},
                {"suite file", made.suite_file},
                {"suite seed", seed_fact(manifest)},
                {"instance set", made.instance_set}};
  std::string memory;
  for (const auto& [scene, bytes] : object_of(made.machine, "scene_memory_bytes").items())
    if (bytes.is_number_unsigned() && bytes.get<double>() > 0)
      memory += (memory.empty() ? "" : ", ") + scene + " " + significant(bytes.get<double>() / 1e6, 3) + " MB";
  if (!memory.empty()) made.facts.push_back({"memory to create scenes", memory});
  if (const std::string note = records::builds_note(manifest); !note.empty()) made.notes.push_back(note);
  if (!list_of(manifest, "sources").empty()) add_merge(made, manifest);
  return made;
}

}  // namespace relign::report
