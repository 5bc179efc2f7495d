#include "runner/mtf_check.h"

#include <utility>

#include "base/error.h"
#include "base/text.h"

namespace relign::runner {

std::optional<plugin_host::MountedAssembly::FieldMtf> check_mtf(const suites::Suite& suite, const std::string& name,
                                                                plugin_host::Scene& scene,
                                                                const trials::SceneFacts& facts) {
  const records::Specification spec = records::specification_of(suite.spec, facts.spec);
  if (!spec.measures_mtf()) return std::nullopt;
  const bool suites_own = suite.spec.is_object() && !suite.spec.empty();
  const auto refuse = [&](const std::string& reason) {
    throw Error(ErrorKind::bad_input, std::string(suites_own ? "the suite's 'spec'" : "the scene's own 'spec'") +
                                          " requires the MTF at " + shortest(spec.lp_per_mm) +
                                          " lp/mm, which is unavailable for the scene '" + name + "': " + reason +
                                          "; remove 'mtf' from the suite's 'spec', or use a scene that offers " +
                                          RELIGN_SCENE_MTF + ", such as those of lens_system");
  };
  if (facts.owns_stage) refuse("the pose of a station's lens is unknown");
  if (suites_own) {
    const Json& mtf = suite.spec["mtf"];
    const bool scene_has_it = records::specification_of(facts.spec, Json()).diffraction;
    if (mtf.contains("diffraction") && mtf["diffraction"].get<bool>() != scene_has_it)
      throw Error(ErrorKind::bad_input,
                  std::string("the suite's 'spec' requires an MTF ") + (scene_has_it ? "without" : "with") +
                      " diffraction, but that of the scene '" + name + "' is " + (scene_has_it ? "with" : "without") +
                      " it; set 'diffraction' in the 'mtf' of the scene file's 'spec', or remove it from the suite's");
  }
  try {
    const auto found = scene.mount("{}").mtf(facts.nominal_pose, spec.lp_per_mm);
    if (!found) refuse("it does not offer it");
    return found;
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::plugin_failed) throw;
    refuse(error.what());
  }
  return std::nullopt;
}

std::vector<std::string> mtf_warnings(const records::Specification& spec, const trials::SceneFacts& facts) {
  std::vector<std::string> warnings;
  if (!(facts.pitch_um > 0)) return warnings;
  const double nyquist = 500 / facts.pitch_um;  // lp/mm
  for (const auto& [key, lp_per_mm] : {std::pair{"mtf", spec.lp_per_mm}, {"field_mtf", spec.field_mtf.lp_per_mm}})
    if (lp_per_mm > nyquist)
      warnings.push_back(std::string("the specification's '") + key + "' is at " + shortest(lp_per_mm) +
                         " lp/mm, above the Nyquist frequency of the sensor, " + significant(nyquist, 4) +
                         " lp/mm with pixels of " + shortest(facts.pitch_um) + " um: no image shows it");
  return warnings;
}

}  // namespace relign::runner
