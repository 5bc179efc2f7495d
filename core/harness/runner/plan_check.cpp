#include "runner/plan_check.h"

#include "base/error.h"
#include "base/json_members.h"
#include "records/manifest_check.h"
#include "runner/stations.h"
#include "runner/verify_folder.h"
#include "suites/plan.h"

namespace relign::runner {
namespace {

const Json& scene_named(const Json& list, const std::string& name) {
  static const Json kNone;
  for (const Json& entry : list)
    if (text_of(entry, "name") == name) return entry;
  return kNone;
}

// What only a scene itself states is taken from the manifest.
trials::SceneFacts stated_facts(const Json& scene) {
  trials::SceneFacts facts;
  const Json& times = object_of(scene, "machine_time");
  const auto take = [&times](const char* key, double& value) {
    if (member(times, key).is_number()) value = member(times, key).get<double>();
  };
  take("speed_mm_per_s", facts.machine_time.speed_mm_per_s);
  take("speed_deg_per_s", facts.machine_time.speed_deg_per_s);
  take("settle_ms", facts.machine_time.settle_ms);
  take("exposure_ms", facts.machine_time.exposure_ms);
  take("readout_ms", facts.machine_time.readout_ms);
  facts.spec = member(scene, "spec");
  facts.owns_stage = flag_of(scene, "owns_stage");
  facts.truth = !member(scene, "truth").is_boolean() || flag_of(scene, "truth");
  return facts;
}

PreparedPlan stated_plan(suites::Suite suite, const Json& manifest) {
  PreparedPlan prepared;
  for (const suites::SceneEntry& entry : suite.scenes) {
    const Json& scene = scene_named(list_of(manifest, "scenes"), entry.name);
    prepared.scenes.push_back(stated_facts(scene));
    prepared.scene_identity.push_back(canonical_json(member(scene, "data")));
  }
  leave_out_told_methods(suite, prepared.scenes);
  prepared.plan = suites::make_plan(std::move(suite), prepared.scene_identity);
  leave_out_told_trials(prepared.plan, prepared.scenes);
  return prepared;
}

// An error of several lines as one: its first.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

}  // namespace

records::Check check_plan(const Json& manifest, plugin_host::Catalog catalog,
                          const std::filesystem::path& suite_folder) {
  records::Check check;
  check.name = "plan";
  if (!records::has_suites(manifest)) {
    check.not_made = "the manifest lacks the text of its suite";
    return check;
  }
  catalog.start_no_scripts();
  try {
    std::vector<PreparedPlan> plans;
    for (const StoredSuite& stored : suites_of(manifest)) {
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
