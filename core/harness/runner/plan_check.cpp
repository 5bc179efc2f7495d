#include "runner/plan_check.h"

#include "base/error.h"
#include "runner/stations.h"
#include "runner/verify_folder.h"
#include "suites/plan.h"

namespace relign::runner {
namespace {

// What only a scene itself states is taken from the manifest.
trials::SceneFacts stated_facts(const records::ManifestScene& scene) {
  trials::SceneFacts facts;
  facts.machine_time = trials::changed_by(scene.machine_time, facts.machine_time);
  facts.spec = scene.spec;
  facts.owns_stage = scene.owns_stage;
  facts.truth = scene.truth;
  return facts;
}

PreparedPlan stated_plan(suites::Suite suite, const records::Manifest& manifest) {
  PreparedPlan prepared;
  for (const suites::SceneEntry& entry : suite.scenes) {
    const records::ManifestScene* found = manifest.scene(entry.name);
    const records::ManifestScene scene = found ? *found : records::ManifestScene{};
    prepared.scenes.push_back(stated_facts(scene));
    prepared.scene_identity.push_back(canonical_json(scene.data));
  }
  leave_out_told_methods(suite, prepared.scenes);
  prepared.plan = suites::make_plan(std::move(suite), prepared.scene_identity);
  leave_out_told_trials(prepared.plan, prepared.scenes);
  return prepared;
}

// An error of several lines as one: its first.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

}  // namespace

records::Check check_plan(const records::Manifest& manifest, plugin_host::Catalog catalog,
                          const std::filesystem::path& suite_folder) {
  records::Check check;
  check.name = "plan";
  if (!manifest.has_suites()) {
    check.not_made = "the manifest lacks the text of its suite";
    return check;
  }
  catalog.start_no_scripts();
  try {
    std::vector<PreparedPlan> plans;
    for (const records::StoredSuite& stored : manifest.stored_suites()) {
      const std::filesystem::path folder =
          suite_folder.empty() ? std::filesystem::path(stored.file).parent_path() : suite_folder;
      suites::Suite suite =
          suites::read_suite(JsonSource::from_text(stored.text, stored.file), folder.empty() ? "." : folder, catalog);
      suite.name = stored.name;
      plans.push_back(stated_plan(std::move(suite), manifest));
    }
    for (std::string& finding : plan_contradictions(manifest, plans)) check.add(std::move(finding));
    if (const std::size_t other = trials_of_no_plan(manifest, plans); other > 0)
      check.not_made = "with the plugins that are installed here the suite plans other trials than " +
                       std::to_string(other) + " of those in the manifest";
  } catch (const Error& error) {
    check.not_made = first_line(error.what());
  }
  return check;
}

}  // namespace relign::runner
