// relign-bench render: renders an image of a lens at a pose, or an animation along a path of poses.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <vector>

#include "base/error.h"
#include "base/json_source.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/animation.h"
#include "cli/app.h"
#include "cli/chosen_lens.h"
#include "cli/contact_sheet.h"
#include "cli/workbench.h"
#include "images/image_file.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct RenderArguments {
  std::string scene = "relign_od";
  std::string pose = "nominal";
  LensChoice lens;
  std::string target, sampler, transport;
  std::uint64_t samples = 0;
  std::uint64_t seed = 0;
  bool noise_free = false;
  bool derivatives = false;
  double error = 0;  // 0: not given
  std::string path;  // of poses; empty: one image
  int frames = 50;
  double frames_per_second = 20;
  std::string errors, beside;  // of a contact sheet
  std::string out = "render.png";
};

// The scene parameters that options set. Throws Error(bad_input) for parameters that the scene does not have.
Json scene_parameters(const RenderArguments& arguments, const plugin_host::Manifest& scene, const std::string& used) {
  Json given = Json::object();
  const auto add = [&](const char* name, bool wanted, const Json& value, const char* option = nullptr) {
    if (!wanted) return;
    const plugin_host::Parameter* parameter = scene.parameter(name);
    if (parameter == nullptr)
      throw Error(ErrorKind::bad_input, std::string("--") + (option ? option : name) + ": scene '" + used +
                                            "' has no parameter '" + name +
                                            "'; see: " + own_command("describe " + shell_quoted(used)));
    const bool is_file = parameter->type == plugin_host::ParameterType::file;
    given[name] = is_file ? Json(fs::absolute(value.get<std::string>()).string()) : value;
  };
  add("target", !arguments.target.empty(), arguments.target);
  add("sampler", !arguments.sampler.empty(), arguments.sampler);
  add("transport", !arguments.transport.empty(), arguments.transport);
  add("imaging_errors", !arguments.errors.empty(), arguments.errors, "randomise");
  add("samples", arguments.samples > 0 && !arguments.noise_free && !arguments.derivatives, arguments.samples);
  return given;
}

LoadedScene load_chosen_scene(Context& context, const RenderArguments& arguments) {
  plugin_host::Catalog& catalog = context.catalog();
  plugin_host::Choice plain = named_choice(catalog, plugin_host::Kind::scene, arguments.scene, "--scene");
  const Json given = scene_parameters(arguments, *plain.plugin, arguments.scene);
  if (given.empty()) return load_scene(std::move(plain), context.services(core_count()));
  return load_scene(named_choice(catalog, plugin_host::Kind::scene, arguments.scene, "--scene", given),
                    context.services(core_count()));
}

int render_animation(Context& context, const RenderArguments& arguments, const LoadedScene& scene) {
  const ChosenLens lens = choose_lens(context, arguments.lens, scene);
  const std::vector<std::vector<double>> path = read_pose_path(arguments.path, scene, lens);
  plugin_host::MountedAssembly assembly = scene.scene->mount(lens.offsets);
  AnimationPlan plan;
  plan.poses = frames_along(path, arguments.frames);
  plan.seed = arguments.seed;
  plan.noise_free = arguments.noise_free;
  plan.frames_per_second = arguments.frames_per_second;
  plan.out = arguments.out;
  plan.scene_id = arguments.scene;
  animate(assembly, scene.facts, plan, context.progress_mode());
  if (context.json)
    print_result(Json({{"animation", arguments.out}, {"frames", plan.poses.size()}, {"poses", plan.poses}}).dump(2) +
                 "\n");
  else
    print_result(arguments.out + "\n");
  return kDone;
}

constexpr double kUsualError = 0.0003;

struct TakenImage {
  images::Image image;
  std::optional<plugin_host::MountedAssembly::Average> average;  // with --noise-free, if the scene reports the error
};

TakenImage take(plugin_host::MountedAssembly& assembly, const LoadedScene& scene, const std::vector<double>& pose,
                const RenderArguments& arguments) {
  if (!arguments.noise_free) return {take_image(assembly, scene.facts, pose, arguments.seed, arguments.scene), {}};
  TakenImage taken{images::Image(scene.facts.image_width, scene.facts.image_height), {}};
  const double wanted = arguments.error > 0 ? arguments.error : kUsualError;
  taken.average = assembly.render_average(pose, arguments.seed, wanted, arguments.samples, taken.image.values.data());
  if (!taken.average) {
    if (arguments.error > 0 || arguments.samples > 0)
      throw Error(ErrorKind::bad_input, std::string(arguments.error > 0 ? "--error" : "--samples") + ": scene '" +
                                            arguments.scene +
                                            "' does not report the error of its noise-free images; omit the option");
    return {take_image(assembly, scene.facts, pose, std::nullopt, arguments.scene), {}};
  }
  const double reached = taken.average->standard_error;
  if (arguments.samples == 0 && reached > wanted)
    print_warning("--error: the standard error is " + significant(reached, 3) + ", not " + shortest(wanted) +
                  ": stopped at " + std::to_string(taken.average->samples_used) +
                  " rays per pixel; allow a larger error, or set the rays per pixel with --samples");
  return taken;
}

// What --json says of an image.
Json described(const RenderArguments& arguments, const LoadedScene& scene, const ChosenLens& lens,
               const std::vector<double>& pose) {
  return {{"image", arguments.out},
          {"width", scene.facts.image_width},
          {"height", scene.facts.picture_height()},
          {"white", scene.facts.image_white},
          {"pose", pose},
          {"elements", valid_json(lens.offsets)}};
}

// The image of each derivative is in the folder of --out: render.png -> render-x.png, render-Rx.png, ...
fs::path beside(const std::string& out, const std::string& axis) {
  const fs::path file = out;
  return file.parent_path() / (file.stem().string() + "-" + axis + file.extension().string());
}

// Writes the derivatives by each axis, and describes them. In a picture grey is 0; white and black are the largest
// slope and its opposite.
Json write_derivatives(const RenderArguments& arguments, const trials::SceneFacts& facts,
                       const std::vector<float>& pixels) {
  const bool picture = fs::path(arguments.out).extension() == ".png";
  Json written = Json::array();
  images::Image image(facts.image_width, facts.image_height);
  for (std::size_t axis = 0; axis < facts.axes.size(); ++axis) {
    const auto first = pixels.begin() + static_cast<std::ptrdiff_t>((axis + 1) * image.values.size());
    std::copy_n(first, image.values.size(), image.values.begin());
    float largest = 0;
    for (const float value : image.values) largest = std::max(largest, std::fabs(value));
    if (picture)
      for (float& value : image.values) value = largest > 0 ? 0.5F + 0.5F * value / largest : 0.5F;
    const std::string file = beside(arguments.out, facts.axes[axis].name).string();
    images::write_image(file, image, 1.0F);
    written.push_back({{"axis", facts.axes[axis].name},
                       {"image", file},
                       {"largest", largest},
                       {"travel", facts.axes[axis].travel()},
                       {"unit", facts.axes[axis].unit}});
  }
  return written;
}

int render_derivatives(Context& context, const RenderArguments& arguments, const LoadedScene& scene) {
  constexpr std::uint64_t kUsualSamples = 1024, kMostSamples = 1U << 20;
  if (arguments.error > 0)
    throw Error(ErrorKind::bad_input, "--derivatives: cannot be combined with --error; use --samples");
  if (arguments.samples > kMostSamples)
    throw Error(ErrorKind::bad_input, "--samples: with --derivatives at most " + std::to_string(kMostSamples) +
                                          ", found " + std::to_string(arguments.samples));
  const ChosenLens lens = choose_lens(context, arguments.lens, scene);
  const std::vector<double> pose = chosen_pose(arguments.pose, "--pose", scene, lens);
  plugin_host::MountedAssembly assembly = scene.scene->mount(lens.offsets);
  images::Image image(scene.facts.image_width, scene.facts.image_height);
  std::vector<float> pixels((scene.facts.axes.size() + 1) * image.values.size());
  const std::uint64_t samples = arguments.samples > 0 ? arguments.samples : kUsualSamples;
  if (!assembly.render_slopes(pose, arguments.seed, static_cast<std::uint32_t>(samples), {}, pixels.data()))
    throw Error(ErrorKind::bad_input, "--derivatives: the images of scene '" + arguments.scene +
                                          "' have none, with these parameters; " + kScenesWithDerivatives);
  std::copy_n(pixels.begin(), image.values.size(), image.values.begin());
  images::write_image(arguments.out, image, static_cast<float>(scene.facts.image_white));
  const Json derivatives = write_derivatives(arguments, scene.facts, pixels);
  if (context.json) {
    Json result = described(arguments, scene, lens, pose);
    result["samples"] = samples;
    result["derivatives"] = derivatives;
    print_result(result.dump(2) + "\n");
    return kDone;
  }
  print_result(arguments.out + "\n");
  for (const Json& one : derivatives) print_result(one["image"].get<std::string>() + "\n");
  for (const Json& one : derivatives)
    std::fprintf(stderr, "%s: at most %s per travel of %s %s\n", one["axis"].get<std::string>().c_str(),
                 significant(one["largest"].get<double>(), 3).c_str(), shortest(one["travel"].get<double>()).c_str(),
                 one["unit"].get<std::string>().c_str());
  return kDone;
}

int render_sheet(Context& context, const RenderArguments& arguments, bool posed) {
  const auto refuse = [](const char* option, bool given) {
    if (given)
      throw Error(ErrorKind::bad_input,
                  std::string("--randomise: cannot be combined with ") + option +
                      "; it renders captures of ten instances, near the optimum and at the start");
  };
  if (arguments.errors.empty()) throw Error(ErrorKind::bad_input, "--randomise: expected a file of imaging errors");
  refuse("--animate", !arguments.path.empty());
  refuse("--assembly", !arguments.lens.assembly.empty());
  refuse("--noise-free", arguments.noise_free);
  refuse("--derivatives", arguments.derivatives);
  refuse("--pose", posed);
  if (fs::path(arguments.out).extension() != ".png")
    throw Error(ErrorKind::bad_input, "--out: '" + arguments.out + "' must end in .png for --randomise");
  const LoadedScene scene = load_chosen_scene(context, arguments);
  ContactSheet sheet{arguments.lens, arguments.seed, arguments.beside, arguments.scene, arguments.out};
  if (sheet.lens.level.empty()) sheet.lens.level = "rho0.5";
  return render_contact_sheet(context, sheet, scene);
}

int render(Context& context, const RenderArguments& arguments, bool posed, bool randomised) {
  if (randomised) return render_sheet(context, arguments, posed);
  if (arguments.error > 0 && !arguments.noise_free && !arguments.derivatives)
    throw Error(ErrorKind::bad_input, "--error: requires --noise-free; captures have the scene's own noise");
  if (arguments.error > 0 && arguments.samples > 0)
    throw Error(ErrorKind::bad_input, "--error: cannot be combined with --samples; give one of them");
  const std::string ending = fs::path(arguments.out).extension().string();
  const bool moving = ending == ".gif" || ending == ".mp4";
  if (moving != !arguments.path.empty() || (!moving && ending != ".png" && ending != ".npy" && ending != ".tiff"))
    throw Error(ErrorKind::bad_input, "--out: '" + arguments.out + "' must end in " +
                                          (arguments.path.empty() ? ".png, .npy or .tiff; .gif and .mp4 need --animate"
                                                                  : ".gif or .mp4 for --animate"));
  const LoadedScene scene = load_chosen_scene(context, arguments);
  refuse_station(scene, arguments.scene);
  if (moving && arguments.noise_free && (arguments.error > 0 || arguments.samples > 0))
    throw Error(ErrorKind::bad_input,
                std::string(arguments.error > 0 ? "--error" : "--samples") +
                    ": cannot be combined with --animate --noise-free, which uses the scene's own noise-free images");
  if (moving && arguments.derivatives)
    throw Error(ErrorKind::bad_input, "--derivatives: cannot be combined with --animate");
  if (moving) return render_animation(context, arguments, scene);
  if (arguments.derivatives) return render_derivatives(context, arguments, scene);
  const ChosenLens lens = choose_lens(context, arguments.lens, scene);
  const std::vector<double> pose = chosen_pose(arguments.pose, "--pose", scene, lens);

  plugin_host::MountedAssembly assembly = scene.scene->mount(lens.offsets);
  const auto [image, average] = take(assembly, scene, pose, arguments);
  images::write_image(arguments.out, image, static_cast<float>(scene.facts.image_white));

  if (context.json) {
    Json result = described(arguments, scene, lens, pose);
    if (average) {
      result["standard_error"] = average->standard_error;
      result["samples"] = average->samples_used;
    }
    print_result(result.dump(2) + "\n");
  } else {
    print_result(arguments.out + "\n");
    if (average)
      std::fprintf(stderr,
                   "standard error %s per pixel (root mean square over the image, in the unit of RMSE; white is %s), "
                   "%llu rays per pixel\n",
                   significant(average->standard_error, 2).c_str(), significant(scene.facts.image_white, 3).c_str(),
                   static_cast<unsigned long long>(average->samples_used));
  }
  return kDone;
}

}  // namespace

void add_render(CLI::App& app, Context& context) {
  CLI::App& verb =
      add_verb(app, {"render", "Render one image of a lens at a pose, or an animation along a path of poses.",
                     "relign-bench render --noise-level rho0.5 --instance 3 --pose start -o start.png\n"
                     "relign-bench render --pose 0.5,0.5,0.45,0.5,0.5 --noise-free -o defocus.npy\n"
                     "relign-bench render --pose start --noise-level rho0.5 --derivatives -o start.png\n"
                     "relign-bench render --noise-level rho0.5 --animate 'start->nominal' -o moving.gif\n"
                     "relign-bench render --randomise errors.json --beside relign_od-package -o sheet.png",
                     "try, describe, lens draw, scene landscape"});
  auto arguments = std::make_shared<RenderArguments>();
  RenderArguments& given = *arguments;
  verb.add_option(
          "-o,--out", given.out,
          "output file: .png (16 bit, lit pixels white), .tiff or .npy (float32, irradiance for radiance 1); with "
          "--animate: .gif or .mp4 (requires ffmpeg)")
      ->type_name("FILE")
      ->capture_default_str();
  verb.add_option("--scene", given.scene, "scene: id, preset, path, or an object as in a suite")
      ->type_name("SCENE")
      ->capture_default_str();
  verb.add_option("--pose", given.pose,
                  "true pose: nominal, start, optimum (the lens's own), or one number per axis as a fraction of the "
                  "travel, 0 to 1")
      ->type_name("POSE:{nominal,start,optimum}")
      ->capture_default_str();
  add_lens_options(verb, given.lens);
  verb.add_option("--target", given.target,
                  "target to image: an image file, or a name such as chessboard or slanted_edges:angle_deg=3 "
                  "[default: the scene's]")
      ->type_name("TARGET");
  verb.add_option("--sampler", given.sampler, "ray sampler: paper, hemisphere, pupil or lattice [default: the scene's]")
      ->type_name("NAME:{paper,hemisphere,pupil,lattice}");
  verb.add_option("--transport", given.transport, "light transport: refract, fresnel or ghost [default: the scene's]")
      ->type_name("NAME:{refract,fresnel,ghost}");
  verb.add_option("--samples", given.samples,
                  "rays per pixel [default: the scene's; with --noise-free, as many as --error requires]")
      ->type_name("COUNT")
      ->check(whole_number());
  verb.add_option("--seed", given.seed, "seed of the image's noise; with --noise-free, of the residual noise")
      ->type_name("SEED")
      ->check(whole_number())
      ->capture_default_str();
  verb.add_flag("--noise-free", given.noise_free,
                "render the expected image: average until --error is reached, and print the error");
  verb.add_option("--error", given.error,
                  "with --noise-free: standard error per pixel to reach (root mean square over the image, in the unit "
                  "of RMSE) [default: 0.0003]")
      ->type_name("NUMBER")
      ->check(CLI::Range(1e-9, 1e9));
  verb.add_flag("--derivatives", given.derivatives,
                "render the expected image from --samples rays per pixel [default: 1024] and its derivative by each "
                "axis, per whole travel: start.png, start-x.png, ...; in a .png grey is 0");
  verb.add_option("--animate", given.path,
                  "render an animation along a path of true poses: as for --pose, separated by '->', or a file "
                  "{\"poses\": [[...], \"nominal\", ...]}")
      ->type_name("PATH");
  verb.add_option("--frames", given.frames, "number of frames of the animation; frame k uses seed + k")
      ->type_name("COUNT")
      ->check(CLI::Range(2, 10000))
      ->capture_default_str();
  verb.add_option("--fps", given.frames_per_second, "frames per second; at most 50 in a GIF")
      ->type_name("NUMBER")
      ->check(CLI::Range(0.1, 120.0))
      ->capture_default_str();
  CLI::Option* randomise = verb.add_option("--randomise", given.errors,
                                           "render a contact sheet of twenty captures with these imaging errors, as "
                                           "relign-train imitate --randomise trains on: ten instances of rho0.5, or of "
                                           "--noise-level from --instance on, near the optimum and at the start")
                               ->type_name("FILE");
  verb.add_option("--beside", given.beside,
                  "with --randomise: add ten captures of this scene for comparison, of the same instances")
      ->type_name("SCENE")
      ->needs(randomise);
  const CLI::Option* pose = verb.get_option("--pose");
  verb.callback([&context, arguments, pose, randomise] {
    context.action = [&context, arguments, pose, randomise] {
      return render(context, *arguments, pose->count() > 0, randomise->count() > 0);
    };
  });
}

}  // namespace relign::cli
