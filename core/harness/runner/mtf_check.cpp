#include "runner/mtf_check.h"

#include "base/error.h"
#include "base/text.h"
#include "records/specification.h"

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

}  // namespace relign::runner
