// relign-bench render: one image of one lens at one pose.
#include <cstdint>
#include <filesystem>
#include <optional>

#include "base/error.h"
#include "base/json_source.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/workbench.h"
#include "pixels/image_file.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct RenderArguments {
  std::string scene = "relign_od";
  std::string pose = "nominal";
  std::string level;
  std::uint64_t instance = 0;
  std::uint64_t suite_seed = 1;
  std::string assembly;
  std::string target, sampler, transport;
  std::uint64_t samples = 0;
  std::uint64_t seed = 0;
  bool noise_free = false;
  std::string out = "render.png";
};

// The options that stand for parameters of the scene; a scene without them says so.
Json scene_parameters(const RenderArguments& arguments, const plugin_host::Manifest& scene, const std::string& used) {
  Json given = Json::object();
  const auto add = [&](const char* name, bool wanted, const Json& value) {
    if (!wanted) return;
    const plugin_host::Parameter* parameter = scene.parameter(name);
    if (parameter == nullptr)
      throw Error(ErrorKind::bad_input, std::string("--") + name + ": scene '" + used + "' has no parameter '" + name +
                                            "'; see: relign-bench describe " + used);
    const bool is_file = parameter->type == plugin_host::ParameterType::file;
    given[name] = is_file ? Json(fs::absolute(value.get<std::string>()).string()) : value;
  };
  add("target", !arguments.target.empty(), arguments.target);
  add("sampler", !arguments.sampler.empty(), arguments.sampler);
  add("transport", !arguments.transport.empty(), arguments.transport);
  add("samples", arguments.samples > 0, arguments.samples);
  return given;
}

LoadedScene load_chosen_scene(Context& context, const RenderArguments& arguments) {
  plugin_host::Catalog& catalog = context.catalog();
  plugin_host::Choice plain = catalog.resolve_or_throw(plugin_host::Kind::scene, arguments.scene);
  const Json given = scene_parameters(arguments, *plain.plugin, arguments.scene);
  if (given.empty()) return load_scene(std::move(plain), context.services(core_count()));
  return load_scene(catalog.resolve_or_throw(plugin_host::Kind::scene, arguments.scene, given),
                    context.services(core_count()));
}

// The offsets of an assembly file, as mount takes them.
std::string read_assembly(const fs::path& file, const task::SceneFacts& facts) {
  const JsonSource source = JsonSource::from_file(file);
  std::vector<Problem> problems;
  ObjectReader reader(source, "", problems);
  const Json* elements = reader.get("elements");
  reader.refuse_unknown();
  if (elements == nullptr) {
    problems.push_back(source.problem("",
                                      "'elements' is missing; allowed: {\"elements\": {\"L2\": {\"tilt_deg\": "
                                      "[rx, ry], \"shift_mm\": [x, y, z]}}}"));
  } else if (!elements->is_object()) {
    problems.push_back(source.problem("/elements", "an object of elements by name is needed"));
  } else {
    for (const auto& [name, offsets] : elements->items()) {
      const std::string pointer = "/elements/" + name;
      if (std::find(facts.elements.begin(), facts.elements.end(), name) == facts.elements.end())
        problems.push_back(
            source.problem(pointer, "unknown element '" + name + "'" + suggestion(name, facts.elements)));
      ObjectReader offset_reader(source, pointer, problems);
      offset_reader.numbers("shift_mm", 3, {0, 0, 0});
      offset_reader.numbers("tilt_deg", 2, {0, 0});
      offset_reader.refuse_unknown();
    }
  }
  throw_if_any(problems);
  return elements->dump();
}

std::vector<double> chosen_pose(const RenderArguments& arguments, const task::SceneFacts& facts,
                                const std::optional<task::Instance>& instance) {
  if (arguments.pose == "nominal") return facts.nominal_pose;
  if (arguments.pose == "start") {
    if (!instance)
      throw Error(ErrorKind::bad_input, "--pose start: only an instance has a start; give --noise-level too");
    return instance->variances.start;
  }
  const std::vector<double> pose = parse_numbers(arguments.pose, "--pose");
  std::vector<std::string> names;
  for (const task::Axis& axis : facts.axes) names.push_back(axis.name);
  if (pose.size() != facts.axes.size())
    throw Error(ErrorKind::bad_input, "--pose: " + std::to_string(pose.size()) + " numbers given, " +
                                          std::to_string(facts.axes.size()) + " needed: " + join(names, ","));
  for (std::size_t axis = 0; axis < pose.size(); ++axis)
    if (pose[axis] < 0 || pose[axis] > 1)
      throw Error(ErrorKind::bad_input, "--pose: " + shortest(pose[axis]) + " for " + names[axis] +
                                            " is outside 0 to 1 (shares of the travel)");
  return pose;
}

int render(Context& context, const RenderArguments& arguments) {
  if (!arguments.assembly.empty() && !arguments.level.empty())
    throw Error(ErrorKind::bad_input, "--assembly and --noise-level both say which lens to mount; give one of them");
  const std::string ending = fs::path(arguments.out).extension().string();
  if (ending != ".png" && ending != ".npy" && ending != ".tiff")
    throw Error(ErrorKind::bad_input, "--out: '" + arguments.out + "' must end in .png, .npy or .tiff");

  const LoadedScene scene = load_chosen_scene(context, arguments);
  if (scene.facts.owns_stage)
    throw Error(ErrorKind::bad_input, "--scene: '" + arguments.scene +
                                          "' is a station; it shows no pose on demand. Watch it in a trial: "
                                          "relign-bench try ALGORITHM --scene " +
                                          arguments.scene + " --frames DIR");
  std::optional<task::Instance> instance;
  std::string offsets = "{}";
  if (!arguments.level.empty()) {
    const plugin_host::Choice level =
        context.catalog().resolve_or_throw(plugin_host::Kind::noise_level, arguments.level);
    instance = draw_instance(level, scene, context.services(1), arguments.suite_seed, arguments.instance);
    offsets = instance->variances.elements_json;
  }
  if (!arguments.assembly.empty()) offsets = read_assembly(arguments.assembly, scene.facts);
  const std::vector<double> pose = chosen_pose(arguments, scene.facts, instance);

  plugin_host::MountedAssembly assembly = scene.scene->mount(offsets);
  pixels::Image image(scene.facts.image_width, scene.facts.image_height);
  if (!arguments.noise_free) {
    assembly.capture(pose, arguments.seed, image.values.data());
  } else if (!assembly.render_noise_free(pose, image.values.data())) {
    throw Error(ErrorKind::bad_input, "--noise-free: scene '" + arguments.scene + "' offers no noise-free images");
  }
  pixels::write_image(arguments.out, image, static_cast<float>(scene.facts.image_white));

  if (context.json) {
    const Json result = {{"image", arguments.out}, {"width", image.width},
                         {"height", image.height}, {"white", scene.facts.image_white},
                         {"pose", pose},           {"elements", Json::parse(offsets)}};
    print_result(result.dump(2) + "\n");
  } else {
    print_result(arguments.out + "\n");
  }
  return kDone;
}

}  // namespace

void add_render(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"render", "Render one image of a lens at a pose.",
                                  "relign-bench render --noise-level rho0.5 --instance 3 --pose start -o start.png\n"
                                  "relign-bench render --pose 0.5,0.5,0.45,0.5,0.5 --noise-free -o defocus.npy",
                                  "try, describe"});
  auto arguments = std::make_shared<RenderArguments>();
  RenderArguments& given = *arguments;
  verb.add_option("-o,--out", given.out,
                  "image file: .png (16 bit, lit = white), .tiff or .npy (float32, irradiance for radiance 1)")
      ->type_name("FILE")
      ->capture_default_str();
  verb.add_option("--scene", given.scene, "id, preset or path of a scene")->type_name("SCENE")->capture_default_str();
  verb.add_option("--pose", given.pose,
                  "true pose: nominal, start, or one number per axis, shares of the travel, 0 to 1")
      ->type_name("POSE")
      ->capture_default_str();
  verb.add_option("--noise-level", given.level, "mount the lens of an instance of this level [default: a perfect lens]")
      ->type_name("LEVEL");
  verb.add_option("--instance", given.instance, "number of the instance, from 0")
      ->type_name("NUMBER")
      ->check(whole_number())
      ->capture_default_str();
  verb.add_option("--suite-seed", given.suite_seed, "seed of the suite that the instance belongs to")
      ->type_name("SEED")
      ->check(whole_number())
      ->capture_default_str();
  verb.add_option("--assembly", given.assembly, "mount this lens: JSON with shift_mm and tilt_deg per element")
      ->type_name("FILE");
  verb.add_option("--target", given.target,
                  "show the lens this: an image file, or a name such as chessboard or slanted_edges:angle_deg=3 "
                  "[default: the scene's]")
      ->type_name("TARGET");
  verb.add_option("--sampler", given.sampler, "paper, hemisphere or pupil [default: the scene's]")->type_name("NAME");
  verb.add_option("--transport", given.transport, "refract or fresnel [default: the scene's]")->type_name("NAME");
  verb.add_option("--samples", given.samples, "rays a pixel [default: the scene's]")
      ->type_name("COUNT")
      ->check(whole_number());
  verb.add_option("--seed", given.seed, "seed of the frame's noise")
      ->type_name("SEED")
      ->check(whole_number())
      ->capture_default_str();
  verb.add_flag("--noise-free", given.noise_free, "the expected image, without noise");
  verb.callback(
      [&context, arguments] { context.action = [&context, arguments] { return render(context, *arguments); }; });
}

}  // namespace relign::cli
