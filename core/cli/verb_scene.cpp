// relign-bench scene landscape and tolerances: the error over the poses of a scene, and over its lenses.
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/chosen_lens.h"
#include "cli/interrupt.h"
#include "cli/tolerance_table.h"
#include "cli/workbench.h"
#include "drawing/landscape.h"
#include "drawing/png.h"
#include "plugin_host/packed.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kLandscapePngScale = 2;  // pixels per unit of the drawing
// The same for all poses, so that neighbouring estimates have nearly the same residual error and the map is smooth.
constexpr std::uint64_t kTruthSeed = 4;

struct LandscapeArguments {
  std::string scene = "relign_od";
  std::string pose = "nominal";
  LensChoice lens;
  int points = 21;
  bool arrows = false;
  std::string out = "landscape";
};

// The gradient of the noise-free MSE by the shares of the axes; empty where the scene offers no derivatives. Unbiased:
// the difference of a render from the reference is multiplied by the derivatives of another, independent render.
std::vector<double> mse_gradient(plugin_host::MountedAssembly& assembly, const std::vector<float>& reference,
                                 const std::vector<double>& pose) {
  // Noise averages over the pixels: larger images get fewer rays each.
  constexpr std::size_t kRays = 320'000, kMostSamples = 8;
  const std::size_t pixels = reference.size();
  const auto samples = static_cast<std::uint32_t>(std::clamp<std::size_t>(kRays / pixels, 1, kMostSamples));
  std::vector<float> renders[2];
  for (std::uint64_t k = 0; k < 2; ++k) {
    renders[k].resize((pose.size() + 1) * pixels);
    if (!assembly.render_slopes(pose, kTruthSeed + 1 + k, samples, {}, renders[k].data())) return {};
  }
  std::vector<double> gradient(pose.size());
  for (int k = 0; k < 2; ++k)
    for (std::size_t axis = 0; axis < pose.size(); ++axis)
      for (std::size_t i = 0; i < pixels; ++i)
        gradient[axis] += static_cast<double>(renders[1 - k][i] - reference[i]) *
                          static_cast<double>(renders[k][(axis + 1) * pixels + i]) / static_cast<double>(pixels);
  return gradient;
}

// Measures the planes through `pose`, one for every pair of axes; with a reference image also slopes for arrows.
void measure_landscape(drawing::Landscape& landscape, plugin_host::MountedAssembly& assembly,
                       const std::vector<double>& pose, const SceneScore& score, const std::vector<float>& reference,
                       ProgressMode mode) {
  const std::atomic<bool>& stop = watch_for_stop();
  const auto pairs = drawing::plane_axes(landscape.axes.size());
  const auto points = static_cast<std::size_t>(landscape.points);
  ProgressPrinter printer(mode, "poses");
  runner::Progress progress;
  progress.doing = "landscape";
  progress.total = pairs.size() * points * points;
  for (const auto& [across, up] : pairs) {
    drawing::LandscapePlane plane;
    plane.across = across;
    plane.up = up;
    for (std::size_t place = 0; place < points * points; ++place) {
      printer.update(progress);
      if (stop) {
        printer.finish();
        throw Error(ErrorKind::stopped, "stopped after " + std::to_string(progress.done) + " of " +
                                            counted(progress.total, "pose") + "; nothing was written");
      }
      std::vector<double> here = pose;
      here[across] = static_cast<double>(place % points) / static_cast<double>(points - 1);
      here[up] = static_cast<double>(place / points) / static_cast<double>(points - 1);
      plane.values.push_back(score.shown(assembly.noise_free_mse(here, kTruthSeed).mse));
      // The RMSE has a gradient except at 0.
      if (const double rmse = plane.values.back();
          !reference.empty() && drawing::has_arrow(landscape.points, place) && rmse > score.resolution) {
        const std::vector<double> gradient = mse_gradient(assembly, reference, here);
        plane.slopes[place] = {gradient.at(across) / (2 * rmse), gradient.at(up) / (2 * rmse)};
      }
      ++progress.done;
    }
    landscape.planes.push_back(std::move(plane));
  }
  printer.update(progress);
  printer.finish();
}

std::vector<std::string> write(const drawing::Landscape& landscape, const fs::path& out) {
  std::vector<std::string> written;
  const auto add = [&](const fs::path& file, const std::string& content) {
    write_file_atomically(file, content);
    written.push_back(file.string());
  };
  const std::string ending = out.extension().string();
  const bool all = ending.empty();
  if (all || ending == ".png")
    add(all ? out / "landscape.png" : out,
        drawing::png_bytes(drawing::landscape_raster(landscape, kLandscapePngScale)));
  if (all || ending == ".html") add(all ? out / "landscape.html" : out, drawing::landscape_page(landscape));
  if (all || ending == ".csv") add(all ? out / "landscape.csv" : out, drawing::landscape_table(landscape));
  return written;
}

std::string landscape_subtitle(const LandscapeArguments& arguments) {
  std::string lens = "perfect lens";
  if (!arguments.lens.level.empty())
    lens = "instance " + std::to_string(arguments.lens.instance) + " of " + arguments.lens.level;
  if (!arguments.lens.assembly.empty()) lens = "lens of " + fs::path(arguments.lens.assembly).filename().string();
  const bool named = std::isalpha(static_cast<unsigned char>(arguments.pose.front())) != 0;
  return lens + "; noise-free error in planes through " +
         (arguments.pose == "optimum" ? "its optimum"
          : named                     ? "the " + arguments.pose + " pose"
                                      : "the pose " + arguments.pose);
}

int landscape(Context& context, const LandscapeArguments& arguments) {
  const std::string ending = fs::path(arguments.out).extension().string();
  if (!ending.empty() && ending != ".png" && ending != ".html" && ending != ".csv")
    throw Error(ErrorKind::bad_input,
                "--out: '" + arguments.out + "' must be a folder, or a file that ends in .png, .html or .csv");
  plugin_host::HostServices services = context.services(core_count());
  services.stop = &watch_for_stop();
  const LoadedScene scene =
      load_scene(named_choice(context.catalog(), plugin_host::Kind::scene, arguments.scene, "--scene"), services);
  refuse_station(scene, arguments.scene);
  if (!scene.facts.truth)
    throw Error(ErrorKind::bad_input, "--scene: '" + arguments.scene + "' does not provide noise-free errors");
  if (scene.facts.axes.size() < 2)
    throw Error(ErrorKind::bad_input, "--scene: '" + arguments.scene + "' has fewer than two axes; a plane needs two");
  const ChosenLens lens = choose_lens(context, arguments.lens, scene);
  plugin_host::MountedAssembly assembly = scene.scene->mount(lens.offsets);
  std::vector<float> reference;
  if (arguments.arrows) {
    reference = plugin_host::packed(scene.scene->reference());
    if (!scene.facts.score.squared || mse_gradient(assembly, reference, scene.facts.nominal_pose).empty())
      throw Error(ErrorKind::bad_input, "--arrows: the " + scene.facts.score.label() + " of scene '" + arguments.scene +
                                            "' has no derivatives, with these parameters; " + kScenesWithDerivatives +
                                            "; choose one of these, or leave out --arrows");
  }
  const std::vector<double> pose = chosen_pose(arguments.pose, "--pose", scene, lens);

  drawing::Landscape landscape;
  landscape.title = "Landscape of " + scene.facts.name;
  landscape.subtitle = landscape_subtitle(arguments);
  landscape.measure = scene.facts.score.label();
  // The RMSE is logarithmic in charts of trials, but linear here, where its bowl is to be seen.
  if (const SceneScore& score = scene.facts.score; score.logarithmic && !score.squared)
    landscape.logarithmic_from = score.resolution;
  landscape.points = arguments.points;
  for (std::size_t axis = 0; axis < pose.size(); ++axis) {
    const trials::Axis& known = scene.facts.axes[axis];
    landscape.axes.push_back({known.name, known.unit, known.lower, known.upper, scene.facts.nominal_pose[axis]});
  }
  measure_landscape(landscape, assembly, pose, scene.facts.score, reference, context.progress_mode());
  const std::vector<std::string> written = write(landscape, arguments.out);
  if (context.json)
    print_result(Json({{"files", written}, {"planes", landscape.planes.size()}, {"pose", pose}}).dump(2) + "\n");
  else
    print_result(join(written, "\n") + "\n");
  return kDone;
}

struct TolerancesArguments {
  std::string scene = "relign_od", level = "rho0.5";
  double spec = 0;
  unsigned draws = 2000, check = 4;
  std::uint32_t samples = 64;
};

int tolerances(Context& context, const TolerancesArguments& arguments) {
  const LoadedScene scene =
      load_scene(named_choice(context.catalog(), plugin_host::Kind::scene, arguments.scene, "--scene"),
                 context.services(core_count()));
  refuse_station(scene, arguments.scene);
  const plugin_host::Choice level =
      named_choice(context.catalog(), plugin_host::Kind::noise_level, arguments.level, "--noise-level");
  const ToleranceTable table = tolerance_table(scene, level, context.services(1), arguments.draws,
                                               std::min(arguments.check, arguments.draws), arguments.samples);
  print_result(context.json ? tolerances_json(table, arguments.spec).dump(2) + "\n"
                            : tolerances_text(table, arguments.spec));
  return kDone;
}

void add_tolerances(CLI::App& scene, Context& context) {
  CLI::App& verb =
      add_verb(scene, {"tolerances",
                       "Predict which offsets of elements limit aligned lenses, and their yield, from derivatives.",
                       "relign-bench scene tolerances --noise-level rho0.5 --spec 0.0142", "lens, scene landscape"});
  TolerancesArguments& given = add_action(verb, context, tolerances);
  verb.add_option("--scene", given.scene, "scene that offers derivatives: id, preset, path, or an object as in a suite")
      ->type_name("SCENE")
      ->capture_default_str();
  verb.add_option("--noise-level", given.level, "noise level that draws the offsets: id, or an object as in a suite")
      ->type_name("LEVEL")
      ->capture_default_str();
  verb.add_option("--spec", given.spec, "also print the share of lenses whose RMSE at their best pose is at most this")
      ->type_name("RMSE")
      ->check(CLI::Validator(
          [](const std::string& text) {
            char* end = nullptr;
            const double value = std::strtod(text.c_str(), &end);
            const bool usable = end != text.c_str() && *end == '\0' && value > 0 && value < 1e6;
            return usable ? std::string() : "expected an RMSE above 0, found '" + text + "'";
          },
          ""));
  verb.add_option("--draws", given.draws, "lenses to draw, 20 to 1,000,000, none of them a benchmark instance")
      ->type_name("COUNT")
      ->check(CLI::Range(20U, 1'000'000U))
      ->capture_default_str();
  verb.add_option("--check", given.check,
                  "search for the best poses of this many of them, at most 1,000, to compare with the prediction")
      ->type_name("COUNT")
      ->check(CLI::Range(0U, 1000U))
      ->capture_default_str();
  verb.add_option("--samples", given.samples, "rays per pixel of the derivatives, at most 65,536")
      ->type_name("COUNT")
      ->check(CLI::Range(1U, 65'536U))
      ->capture_default_str();
}

}  // namespace

void add_scene(CLI::App& app, Context& context) {
  CLI::App& scene =
      add_verb(app, {"scene", "Create a scene from a lens file, or map its error over poses and tolerances.",
                     "relign-bench scene landscape --scene relign_od -o landscape", "lens, render"});
  scene.require_subcommand(1);
  CLI::App& verb = add_verb(scene, {"landscape", "Map the noise-free error over every pair of axes.",
                                    "relign-bench scene landscape --noise-level rho0.5 --instance 3 -o landscape\n"
                                    "relign-bench scene landscape --scene gaussian_spot -o spot.html\n"
                                    "relign-bench scene landscape --pose optimum --arrows -o arrows",
                                    "lens draw, render, describe"});
  add_tolerances(scene, context);
  LandscapeArguments& given = add_action(verb, context, landscape);
  verb.add_option("-o,--out", given.out,
                  "folder for landscape.png, .html and .csv, or a single file with one of these extensions")
      ->type_name("PATH")
      ->capture_default_str();
  verb.add_option("--scene", given.scene, "scene: id, preset, path, or an object as in a suite")
      ->type_name("SCENE")
      ->capture_default_str();
  verb.add_option(
          "--pose", given.pose,
          "true pose that all planes contain: nominal, start, optimum (the lens's own), or one number per axis as a "
          "fraction of the travel, 0 to 1")
      ->type_name("POSE:{nominal,start,optimum}")
      ->capture_default_str();
  add_lens_options(verb, given.lens);
  verb.add_option("--points", given.points, "poses per axis; ten planes of 21 x 21 poses at 5 ms each take 22 s")
      ->type_name("COUNT")
      ->check(CLI::Range(3, 501))
      ->capture_default_str();
  verb.add_flag("--arrows", given.arrows,
                "draw arrows against the gradient on at most 9 x 9 poses of each plane, and add it to the table; for "
                "scenes that offer derivatives");
}

}  // namespace relign::cli
