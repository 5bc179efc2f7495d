#include "cli/chosen_lens.h"

#include "base/error.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/assembly_file.h"
#include "trials/own_optimum.h"

namespace relign::cli {

constexpr std::uint64_t kOptimumSeed = 4;  // of the search

void add_lens_options(CLI::App& verb, LensChoice& choice) {
  CLI::Option* level = verb.add_option(
      "--noise-level", choice.level,
      "mount the lens of an instance of this noise level (id, or an object as in a suite) [default: a perfect lens]");
  level->type_name("LEVEL");
  verb.add_option("--instance", choice.instance, "instance number, from 0")
      ->type_name("NUMBER")
      ->check(whole_number())
      ->needs(level)
      ->capture_default_str();
  verb.add_option("--suite-seed", choice.suite_seed, "suite seed from which the instance is drawn")
      ->type_name("SEED")
      ->check(whole_number())
      ->needs(level)
      ->capture_default_str();
  verb.add_option("--assembly", choice.assembly,
                  "mount the lens with these element offsets: JSON with shift_mm and tilt_deg per element")
      ->type_name("FILE");
}

ChosenLens choose_lens(Context& context, const LensChoice& choice, const LoadedScene& scene) {
  if (!choice.assembly.empty() && !choice.level.empty())
    throw Error(ErrorKind::bad_input, "--assembly: cannot be combined with --noise-level; give one of them");
  ChosenLens lens;
  if (!choice.level.empty()) {
    const plugin_host::Choice level =
        named_choice(context.catalog(), plugin_host::Kind::noise_level, choice.level, "--noise-level");
    lens.instance = draw_instance(level, scene, context.services(1), choice.suite_seed, choice.instance);
    lens.offsets = lens.instance->perturbations.elements_json;
  }
  if (!choice.assembly.empty()) {
    std::vector<std::string> quantities;
    for (const trials::UncertainQuantity& one : scene.facts.uncertain) quantities.push_back(one.name);
    lens.offsets = read_assembly(choice.assembly, scene.facts.elements, quantities);
  }
  return lens;
}

std::vector<double> chosen_pose(const std::string& text, const std::string& option, const LoadedScene& scene,
                                const ChosenLens& lens) {
  const trials::SceneFacts& facts = scene.facts;
  if (text == "nominal") return facts.nominal_pose;
  if (text == "start") {
    if (!lens.instance)
      throw Error(ErrorKind::bad_input, option + " start: only an instance has a start pose; add --noise-level");
    return lens.instance->perturbations.start;
  }
  if (text == "optimum") {
    plugin_host::MountedAssembly assembly = scene.scene->mount(lens.offsets);
    const auto found = trials::own_optimum(assembly, facts, kOptimumSeed);
    if (!found)
      throw Error(ErrorKind::bad_input,
                  option + " optimum: the scene '" + facts.name + "' neither has nor searches for optima");
    return found->true_pose;
  }
  const std::vector<double> pose = parse_numbers(text, option);
  std::vector<std::string> names;
  for (const trials::Axis& axis : facts.axes) names.push_back(axis.name);
  if (pose.size() != facts.axes.size())
    throw Error(ErrorKind::bad_input, option + ": " + std::to_string(pose.size()) + " numbers given, " +
                                          std::to_string(facts.axes.size()) + " needed: " + join(names, ","));
  for (std::size_t axis = 0; axis < pose.size(); ++axis)
    if (pose[axis] < 0 || pose[axis] > 1)
      throw Error(ErrorKind::bad_input, option + ": " + shortest(pose[axis]) + " for " + names[axis] +
                                            " is outside 0 to 1 (fraction of the travel)");
  return pose;
}

void refuse_station(const LoadedScene& scene, const std::string& scene_id) {
  if (!scene.facts.owns_stage) return;
  throw Error(ErrorKind::bad_input,
              "--scene: '" + scene_id +
                  "' is a hardware station, which cannot render a given pose; "
                  "capture its images in a trial: " +
                  own_command("try ALGORITHM --scene " + shell_quoted(scene_id) + " --frames DIR"));
}

}  // namespace relign::cli
