// relign-bench scene new: creates a scene from the file of a design program.
#include <filesystem>
#include <memory>
#include <optional>

#include "base/displayed_rmse.h"
#include "base/error.h"
#include "base/files.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/interrupt.h"
#include "cli/new_folder.h"
#include "cli/progress.h"
#include "cli/text_table.h"
#include "cli/workbench.h"
#include "imaging/scene_file.h"
#include "imaging/target.h"
#include "lens_files/read_design.h"
#include "lens_files/scene_layout.h"
#include "lens_verbs/camera_line.h"
#include "lens_verbs/design_file.h"
#include "optics/glass.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct NewSceneArguments {
  std::string lens_file;
  std::string out;
  std::string name;
  std::string sensor, camera;  // sizes; one of them at most
  std::string stage, spec;
  unsigned lenses = 10;
  std::string target;
  double distance_mm = 0;
  DesignOptions design;
};

// "Cooke 50 mm" -> "Cooke_50_mm", because names are used in tables and as folder names. One '_' per UTF-8 character.
std::string plain_scene_name(const std::string& name) {
  constexpr std::size_t kLongest = 64;
  std::string plain_scene_name;
  for (const char letter : name) {
    const bool plain = (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') ||
                       (letter >= '0' && letter <= '9') || letter == '-' || letter == '.';
    const bool continuation = (static_cast<unsigned char>(letter) & 0xc0U) == 0x80U;
    if (!continuation && plain_scene_name.size() < kLongest) plain_scene_name += plain ? letter : '_';
  }
  return plain_scene_name;
}

// The scene's name if none is given: the file's name without trailing replacements.
std::string name_of_file(const fs::path& file) {
  std::string name = plain_scene_name(file.stem().string());
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

// A named target is kept as a name; an image file is copied, so that the folder can be moved.
void choose_target(const std::string& target, lens_files::LayoutChoices& choices, NewFiles& files) {
  constexpr int kTexels = 8;  // small: only tests whether the target can be drawn
  choices.target = target;
  if (imaging::draw_target(target, kTexels)) return;
  imaging::target_from_file(target);
  choices.target = "target" + fs::path(target).extension().string();
  choices.target_is_named = false;
  files.emplace_back(choices.target, read_file(target));
}

void throw_if_stopped() {
  if (watch_for_stop()) throw Error(ErrorKind::stopped, "stopped");
}

// Runs `body` on the draft; errors name the wanted folder instead of the draft, and the file that it is made from.
template <class Body>
void check_draft(const std::string& made_from, const fs::path& draft, const fs::path& wanted, Body&& body) {
  try {
    body();
  } catch (const Error& error) {
    std::string text = error.what();
    for (std::size_t at = text.find(draft.string()); at != std::string::npos; at = text.find(draft.string(), at))
      text.replace(at, draft.string().size(), wanted.string());
    throw Error(error.kind(), made_from + ": " + text + "\nnothing was written");
  }
}

// RMSE of the perfect lens's noise-free image at one pixel sideways of the nominal pose, scored as in trials.
double rmse_off_by_one_pixel(Context& context, const fs::path& draft, double pitch_mm, ProgressMode mode) {
  constexpr std::uint64_t kRepeats = 4;
  ProgressPrinter printer(mode, "images");
  runner::Progress progress;
  progress.doing = "reference image and specification";
  progress.total = 1 + kRepeats;
  printer.update(progress);
  const LoadedScene loaded = load_draft(context, draft);
  std::vector<double> pose = loaded.facts.nominal_pose;
  pose.front() += pitch_mm / loaded.facts.axes.front().travel();
  plugin_host::MountedAssembly assembly = loaded.scene->mount("{}");
  double mse = 0;
  for (std::uint64_t seed = 1; seed <= kRepeats; ++seed) {
    throw_if_stopped();
    progress.done = seed;
    printer.update(progress);
    mse += assembly.noise_free_mse(pose, seed).mse / kRepeats;
  }
  return displayed_rmse(mse);
}

void print_made(Context& context, const fs::path& folder, const DesignLens& made, const lens_files::Layout& layout,
                const SpecOutlook& outlook) {
  const lens_files::LensDesign& design = made.design;
  const lens_files::CompleteLens& lens = made.lens;
  const std::vector<std::string> remarks = lens_files::remark_lines(design);
  if (context.json) {
    Json result = {{"folder", fs::absolute(folder).lexically_normal().string()},
                   {"format", design.format},
                   {"elements", lens.lens.elements.size()},
                   {"remarks", remarks}};
    for (const lens_files::LayoutLine& line : layout.lines) result["layout"][line.what] = line.value;
    if (outlook.yield.lenses > 0) result["can_meet_spec"] = outlook_json(outlook);
    print_result(result.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
    return;
  }
  TextTable table({"quantity", "value", "how"});
  for (const lens_files::LayoutLine& line : layout.lines) table.add({line.what, line.value, line.why});
  std::string text = folder.string() + ": " + std::to_string(lens.lens.elements.size()) + " elements from " +
                     design.file + " (" + design.format + ")\n\n" + table.text() + "\n";
  text += remarks.empty() ? "The whole file was used.\n" : "Remarks:\n";
  for (const std::string& remark : remarks) text += "  " + remark + "\n";
  print_text(text);
  const std::string file = (folder / "scene.json").string(), scene = shell_quoted(file);
  // As the suite renders it.
  Json entry = layout.suite["scenes"][0];
  entry.erase("name");
  entry["use"] = file;
  const std::string rendered = entry.contains("parameters") ? shell_quoted(entry.dump()) : scene;
  std::fprintf(stderr, "Next:\n  %s\n  %s\n  %s\n", own_command("lens info --scene " + scene).c_str(),
               own_command("render --scene " + rendered + " -o reference.png").c_str(),
               own_command("run " + shell_quoted((folder / "suite.json").string())).c_str());
}

int new_scene(Context& context, const NewSceneArguments& arguments) {
  lens_files::LayoutChoices choices;
  choices.name = arguments.name.empty() ? name_of_file(arguments.lens_file) : arguments.name;
  if (choices.name.empty() || choices.name[0] == '.' || choices.name != plain_scene_name(choices.name))
    throw Error(ErrorKind::bad_input, "invalid scene name '" + choices.name +
                                          "'; allowed: 1 to 64 letters, digits, '-', '_' or '.', not starting with "
                                          "'.'; choose one with --name");
  choices.distance_mm = arguments.distance_mm;
  choices.polychromatic = arguments.design.polychromatic;
  choices.camera = !arguments.camera.empty();
  if (choices.camera) choices.sensor = lens_files::parse_sensor(arguments.camera, "--camera");
  if (!arguments.sensor.empty()) choices.sensor = lens_files::parse_sensor(arguments.sensor, "--sensor");
  const Json spec = arguments.spec.empty() ? Json() : own_specification(arguments.spec);
  if (!arguments.stage.empty()) choices.movement = movement_of(context, choices.stage = arguments.stage);
  const fs::path wanted = arguments.out.empty() ? choices.name : arguments.out;
  // Named after the folder, so that two imports of one lens have different results folders.
  choices.suite_name = plain_scene_name(fs::absolute(wanted / "").lexically_normal().parent_path().filename().string());
  if (choices.suite_name[0] == '.' || choices.suite_name[0] == '-') choices.suite_name.clear();

  DesignLens made = read_design_lens(arguments.lens_file, arguments.design, choices.name);
  lens_files::LensDesign& design = made.design;
  const lens_files::CompleteLens& lens = made.lens;
  NewFiles files;
  choose_target(!arguments.target.empty() ? arguments.target
                : choices.camera          ? lens_files::chart_for(*choices.sensor)
                                          : "siemens_star",
                choices, files);
  lens_files::Layout layout = lens_files::lay_out(design, lens, choices);
  if (!spec.is_null()) lens_files::set_own_specification(layout, spec, arguments.spec);

  files.emplace_back("lens.json", lens_files::pretty(lens.json));
  files.emplace_back("scene.json", lens_files::pretty(layout.scene));
  files.emplace_back("tolerances.json", lens_files::pretty(layout.tolerances));
  files.emplace_back("suite.json", lens_files::pretty(layout.suite));
  watch_for_stop();
  NewFolder folder(wanted);
  const fs::path draft = folder.write(files);
  std::string warning;
  std::optional<LoadedScene> loaded;
  check_draft(arguments.lens_file, draft, wanted, [&] {
    imaging::read_scene_file(draft / "scene.json", {});
    if (choices.camera || !spec.is_null()) loaded = load_draft(context, draft);
    if (choices.camera) warning = complete_camera(*loaded, layout);
    throw_if_stopped();
    // Rendering millions of pixels takes minutes.
    constexpr double kManyPixels = 1e6;
    const bool large = choices.sensor && 1.0 * choices.sensor->columns * choices.sensor->rows > kManyPixels;
    const ProgressMode mode = large ? *progress_mode_from_name("auto") : ProgressMode::none;
    if (!layout.scene.contains("spec"))
      lens_files::set_specification(layout, rmse_off_by_one_pixel(context, draft, layout.pitch_mm, mode));
    folder.write({{"scene.json", lens_files::pretty(layout.scene)}});
    imaging::read_scene_file(draft / "scene.json", {});
    throw_if_stopped();
  });
  SpecOutlook outlook;
  check_draft(spec.is_null() ? arguments.lens_file : arguments.spec, draft, wanted, [&] {
    if (loaded) outlook = outlook_of(context, *loaded, draft, arguments.lenses, layout);
  });
  folder.write({{"README.md", lens_files::readme(design, lens, choices, layout)}});
  folder.keep();
  for (const std::string& one : {warning, outlook.warning})
    if (!one.empty()) print_warning(wanted.string() + ": " + one);
  print_made(context, wanted, made, layout, outlook);
  return kDone;
}

}  // namespace

void add_scene_new(CLI::App& scene, Context& context) {
  CLI::App& verb = add_verb(
      scene,
      {"new", "Create a scene, tolerances and a runnable suite from a lens file: Zemax .zmx, CODE V .seq or listing.",
       "relign-bench scene new my_lens.zmx -o my_lens --camera 1920x1280@3.45um --stage stepper\n"
       "relign-bench run my_lens/suite.json",
       "scene landscape, lens info, render, validate, run"});
  NewSceneArguments& given = add_action(verb, context, new_scene);
  verb.add_option("LENSFILE", given.lens_file, "lens file of a design program")->required();
  verb.add_option("-o,--out", given.out, "folder to create; must not exist [default: the scene's name]")
      ->type_name("DIR");
  verb.add_option("--name", given.name, "the scene's name [default: the lens file's]")->type_name("NAME");
  CLI::Option* sensor =
      verb.add_option("--sensor", given.sensor,
                      "COLUMNSxROWS@PITCH_UM, or the side in mm of a square sensor of 200 x 200 pixels [default: a "
                      "square sensor that contains the image circle]")
          ->type_name("SIZE");
  verb.add_option("--target", given.target,
                  "target on the emitter: a name such as siemens_star or chessboard, or an image file [default: "
                  "siemens_star; with --camera, camera_chart with squares that suit the sensor]")
      ->type_name("TARGET");
  verb.add_option("--camera", given.camera,
                  "make a camera line on a sensor of COLUMNSxROWS@PITCH_UM: chart, electronics, MTF specification by "
                  "field, and a suite with field-focus")
      ->type_name("SIZE")
      ->excludes(sensor);
  verb.add_option("--stage", given.stage,
                  "errors of the stage: a preset of a noise level such as stepper or hexapod, or a tolerance file with "
                  "'movement' [default: axes that are coupled by 1 %]");
  verb.add_option("--spec", given.spec,
                  "JSON file with the limits of a \"spec\", as in a suite [default: what a shift by one pixel changes; "
                  "with --camera, 0.8 of the design's MTF]")
      ->type_name("FILE");
  verb.add_option("--lenses", given.lenses,
                  "with --camera or --spec, lenses to draw from the tolerances, at most 1,000, to count those that can "
                  "meet the specification")
      ->type_name("COUNT")
      ->check(CLI::Range(0U, 1000U))
      ->capture_default_str();
  verb.add_option("--distance", given.distance_mm,
                  "distance from first vertex to emitter, mm [default: the file's object distance, else far enough to "
                  "be in focus]")
      ->type_name("MM")
      ->check(from_to(1e-3, 1e6, "0.001 to 1000000 mm"));
  add_design_options(verb, given.design);
  verb.add_flag("--polychromatic", given.design.polychromatic,
                "render with all wavelengths of the file and its weights [default: one wavelength]");
}

}  // namespace relign::cli
