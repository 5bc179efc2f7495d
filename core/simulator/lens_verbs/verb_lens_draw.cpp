// relign-bench lens draw: draws the cross-section of a lens with rays.
#include <cmath>
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/assembly_file.h"
#include "cli/workbench.h"
#include "drawing/png.h"
#include "lens_verbs/design_file.h"
#include "lens_verbs/extensions.h"
#include "lens_verbs/lens_files.h"
#include "lens_verbs/lens_section.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kPngScale = 2;      // pixels per unit of the drawing
constexpr double kWidestField = 89;  // degrees

struct DrawArguments {
  std::string lens_file;
  DesignOptions design;
  std::string scene = "relign_od";
  bool scene_given = false;
  std::string fields;
  int rays = kUsualRays;
  std::string assembly;
  bool vertical = false;
  std::string out = "lens.svg";
};

LensSubject subject_of(Context& context, const DrawArguments& arguments) {
  if (arguments.lens_file.empty()) {
    refuse_design_options(arguments.design);
    return subject_of_scene(scene_file_of(context, arguments.scene));
  }
  LensSubject subject;
  subject.lens = lens_of_file(arguments.lens_file, arguments.design);
  subject.name = subject.lens.name;
  return subject;
}

std::vector<double> chosen_fields(const DrawArguments& arguments, const optics::Prescription& lens) {
  if (arguments.fields.empty()) return usual_fields(lens);
  std::vector<double> fields = parse_numbers(arguments.fields, "--fields");
  for (const double field : fields)
    if (!(std::fabs(field) <= kWidestField))
      throw Error(ErrorKind::bad_input, "--fields: " + shortest(field) + " is outside -" + shortest(kWidestField) +
                                            " to " + shortest(kWidestField) + " degrees");
  return fields;
}

int draw(Context& context, const DrawArguments& arguments) {
  if (arguments.scene_given && !arguments.lens_file.empty())
    throw Error(ErrorKind::bad_input, "--scene: cannot be combined with LENSFILE; give one of them");
  const std::string ending = fs::path(arguments.out).extension().string();
  if (ending != ".svg" && ending != ".png")
    throw Error(ErrorKind::bad_input, "--out: '" + arguments.out + "' must end in .svg or .png");

  const LensSubject subject = subject_of(context, arguments);
  std::map<std::string, optics::ElementOffset> offsets;
  if (!arguments.assembly.empty()) {
    std::vector<std::string> names;
    for (const optics::Element& element : subject.lens.elements) names.push_back(element.name);
    const std::string elements = read_assembly(arguments.assembly, names);
    offsets = optics::read_offsets(JsonSource::from_text(elements, arguments.assembly), "", subject.lens);
  }
  const optics::Assembly assembly(subject.lens, offsets);

  drawing::LensPicture picture = picture_of(subject, assembly, !offsets.empty());
  picture.vertical = arguments.vertical;
  Json drawn = Json::array();
  for (const double field : chosen_fields(arguments, subject.lens)) {
    drawing::DrawnFan fan = fan_of(subject, assembly, field, picture.fans.size(), arguments.rays);
    if (fan.rays.empty()) print_warning("no ray at field angle " + fan.label + " passes the lens; none is drawn");
    drawn.push_back({{"field_deg", field}, {"rays", fan.rays.size()}});
    picture.fans.push_back(std::move(fan));
  }
  write_file_atomically(arguments.out, ending == ".svg" ? drawing::lens_svg(picture)
                                                        : drawing::png_bytes(drawing::lens_raster(picture, kPngScale)));
  if (context.json)
    print_result(Json({{"image", arguments.out}, {"lens", subject.lens.name}, {"fields", drawn}}).dump(2) + "\n");
  else
    print_result(arguments.out + "\n");
  return kDone;
}

}  // namespace

void add_lens_draw(CLI::App& lens, Context& context) {
  CLI::App& verb = add_verb(lens, {"draw", "Draw the cross-section of a lens with rays at several field angles.",
                                   "relign-bench lens draw --fields 0,20,42 -o lens.svg\n"
                                   "relign-bench lens draw my_lens.json --assembly tilted.json --vertical -o lens.png",
                                   "lens info, scene landscape, render"});
  DrawArguments& given = add_action(verb, context, draw);
  verb.add_option("LENSFILE", given.lens_file,
                  "lens file: relign-bench .json, Zemax .zmx, CODE V .seq or listing; the object is at infinity "
                  "[default: the scene's "
                  "lens]");
  add_design_options(verb, given.design);
  verb.add_option_function<std::string>(
          "--scene",
          [&given](const std::string& scene) {
            given.scene = scene;
            given.scene_given = true;
          },
          "scene whose lens, sensor and object distance to use: id, preset or path")
      ->type_name("SCENE")
      ->default_str(given.scene);
  verb.add_option("-o,--out", given.out, "output file: .svg or .png")->type_name("FILE")->capture_default_str();
  verb.add_option(
          "--fields", given.fields,
          "comma-separated field angles, degrees, each drawn in its own colour [default: 0, 0.7 of the half field, the "
          "half field]")
      ->type_name("DEGREES");
  verb.add_option("--rays", given.rays, "rays per field, spread over the beam that passes the lens")
      ->type_name("COUNT")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb.add_option("--assembly", given.assembly,
                  "draw the lens with these element offsets: JSON with shift_mm and tilt_deg per element")
      ->type_name("FILE");
  verb.add_flag("--vertical", given.vertical, "draw the light travelling downwards instead of to the right");
}

}  // namespace relign::cli
