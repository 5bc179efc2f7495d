// relign-bench lens info and lens trace. See verb_lens_draw.cpp for lens draw and verb_lens_mesh.cpp for meshes.
#include <cmath>
#include <memory>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/text_table.h"
#include "lens_verbs/design_file.h"
#include "lens_verbs/extensions.h"
#include "lens_verbs/lens_files.h"
#include "optics/first_order.h"
#include "optics/prescription.h"
#include "optics/ray_file.h"
#include "optics/trace.h"

namespace relign::cli {
namespace {

struct LensArguments {
  std::string lens_file;
  DesignOptions design;
  std::string scene = "relign_od";
  std::string rays;
  std::string apertures = "none";
};

struct NamedValue {
  const char* name;
  const char* unit;
  const char* meaning;
  double value;
};

std::vector<NamedValue> first_order_values(const optics::Prescription& lens) {
  const optics::FirstOrder data = optics::first_order(lens);
  std::vector<NamedValue> values = {
      {"focal_length", "mm", "effective focal length", data.focal_length},
      {"back_focal_length", "mm", "last vertex to rear focal point", data.back_focal_length},
      {"front_focal_length", "mm", "first vertex to front focal point", data.front_focal_length},
      {"f_number", "", "focal length / entrance pupil diameter", data.f_number},
      {"image_distance", "mm", "last vertex to image plane", data.image_distance},
      {"overall_length", "mm", "first to last vertex", data.overall_length},
      {"paraxial_image_height", "mm", "focal length x tan(half field)", data.paraxial_image_height},
      {"entrance_pupil_diameter", "mm", "", data.entrance_pupil_diameter},
      {"entrance_pupil_z", "mm", "from the first vertex", data.entrance_pupil_z},
      {"exit_pupil_diameter", "mm", "", data.exit_pupil_diameter},
      {"exit_pupil_from_last", "mm", "from the last vertex", data.exit_pupil_from_last}};
  // The design's specified aperture may differ from the stop, which images use. For a stop on a curved face the
  // tolerance is wider: real rays meet its edge away from the vertex plane, on which first-order optics places it.
  const double tolerance = lens.aperture_stop().on_face ? 0.1 : 0.01;
  optics::Prescription by_stop = lens;
  by_stop.entrance_pupil_diameter_mm = 0;
  const double stop_f_number = optics::first_order(by_stop).f_number;
  if (std::fabs(stop_f_number - data.f_number) > tolerance * std::fabs(data.f_number))
    values.push_back({"f_number_of_opening", "", "from the stop's opening, used for images; f_number is the design's",
                      stop_f_number});
  return values;
}

// A value, or the reason why it is undefined.
struct Distortion {
  double percent = std::nan("");
  std::string reason;
};

Distortion distortion_of(const optics::Prescription& lens) {
  Distortion distortion;
  if (lens.half_field_deg <= 0) {
    distortion.reason = "the lens has no field off the axis";
    return distortion;
  }
  try {
    distortion.percent = 100 * optics::distortion(lens, lens.half_field_deg);
    if (!std::isfinite(distortion.percent))
      distortion.reason = "no chief ray passes at " + significant(lens.half_field_deg, 4) + " degrees";
  } catch (const Error& error) {
    distortion.reason = error.what();
  }
  return distortion;
}

// First-order values are quotients: a lens without power has no focus, a stop at a focal point no pupil.
std::string reason_without(const std::string& name) {
  return name.find("pupil") != std::string::npos ? "the stop is at a focal point, so that its image is at infinity"
                                                 : "the lens has no power";
}

std::string surfaces_table(const optics::Prescription& lens) {
  TextTable table({"surface", "z mm", "radius mm", "index after", "semi-diameter mm", "listing mm"});
  struct Row {
    double z;
    std::vector<std::string> cells;
  };
  std::vector<Row> rows;
  for (const optics::Element& element : lens.elements)
    for (std::size_t f = 0; f < element.faces.size(); ++f) {
      const optics::Face& face = element.faces[f];
      const std::string part = element.faces.size() == 1       ? ""
                               : f == 0                        ? " front"
                               : f + 1 == element.faces.size() ? " back"
                                                               : " inner";
      rows.push_back(
          {face.z_mm,
           {element.name + part, fixed(face.z_mm, 6), face.curvature == 0 ? "plane" : fixed(1 / face.curvature, 5),
            face.mirror ? "mirror" : fixed(std::fabs(face.index_after), 6), fixed(face.clear_radius_mm, 4),
            fixed(face.listing_clear_radius_mm, 6)}});
    }
  for (const optics::Stop& stop : lens.stops) {
    const Row row{stop.z_mm,
                  {stop.name, fixed(stop.z_mm, 6), "stop", "", fixed(stop.opening_radius_mm, 4),
                   stop.in_listing ? fixed(stop.opening_radius_mm, 6) : "-"}};
    // With mirrors the order along the axis is not the order of the light.
    rows.insert(lens.has_mirrors() ? rows.begin() + static_cast<std::ptrdiff_t>(lens.faces_before(stop)) : rows.end(),
                row);
  }
  std::string shapes;
  for (const optics::Element& element : lens.elements)
    for (const optics::Face& face : element.faces)
      if (!face.is_sphere()) {
        shapes += "asphere at z = " + fixed(face.z_mm, 6) + " mm: conic " + shortest(face.conic);
        const auto add = [&](const std::string& letter, std::size_t first_power, const std::vector<double>& terms) {
          for (std::size_t i = 0; i < terms.size(); ++i)
            shapes += ", " + letter + std::to_string(2 * i + first_power) + " " + shortest(terms[i]);
        };
        if (face.r2_term != 0) add("a", 2, {face.r2_term});
        add("a", 4, face.even_asphere);
        add("a", 3, face.odd_asphere);
        add("b", 2, face.over_root);
        shapes += "\n";
      }
  if (!lens.has_mirrors())
    std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.z < b.z; });
  for (const Row& row : rows) table.add(row.cells);
  table.add({"image", fixed(lens.image_z_mm, 6), "plane", "", "", ""});
  return table.text() + shapes;
}

int info(Context& context, const LensArguments& arguments) {
  if (arguments.lens_file.empty()) refuse_design_options(arguments.design);
  const optics::Prescription lens = arguments.lens_file.empty() ? lens_of(context, arguments.scene)
                                                                : lens_of_file(arguments.lens_file, arguments.design);
  const std::vector<NamedValue> values = first_order_values(lens);
  const Distortion distortion = distortion_of(lens);
  if (context.json) {
    Json result = {{"lens", lens.name}, {"source", lens.source}, {"wavelength_nm", lens.wavelength_nm}};
    for (const NamedValue& value : values) {
      const bool defined = std::isfinite(value.value);
      result["first_order"][value.name] = defined ? Json(value.value) : Json();
      if (!defined) result["not_defined"][value.name] = reason_without(value.name);
    }
    for (const optics::Published& published : lens.published) result["published"][published.name] = published.value;
    result["half_field_deg"] = lens.half_field_deg;
    const bool distorts = std::isfinite(distortion.percent);
    result["distortion_percent"] = distorts ? Json(distortion.percent) : Json();
    if (!distorts) result["not_defined"]["distortion_percent"] = distortion.reason;
    print_result(result.dump(2) + "\n");
    return kDone;
  }
  std::string text = lens.name + ", " + significant(lens.wavelength_nm, 4) + " nm\n" + lens.source + "\n\n" +
                     surfaces_table(lens) + "\n";
  TextTable table({"first order", "value", "published", "unit", ""});
  for (const NamedValue& value : values) {
    std::string published = "-";
    for (const optics::Published& known : lens.published)
      if (known.name == value.name) published = fixed(known.value, 4);
    if (std::isfinite(value.value))
      table.add({value.name, fixed(value.value, 4), published, value.unit, value.meaning});
    else
      table.add({value.name, "not defined", published, "", reason_without(value.name)});
  }
  text += table.text();
  if (lens.half_field_deg > 0) {
    const bool distorts = std::isfinite(distortion.percent);
    text += "\ndistortion at " + significant(lens.half_field_deg, 4) + " degrees: " +
            (distorts ? fixed(distortion.percent, 2) + " %" : "not defined (" + distortion.reason + ")") + "\n";
  }
  print_text(text);
  return kDone;
}

int trace_rays(Context& context, const LensArguments& arguments) {
  const optics::Prescription lens = lens_of(context, arguments.scene);
  const JsonSource source = JsonSource::from_file(arguments.rays);
  const auto apertures = arguments.apertures == "mesh"      ? optics::Apertures::mesh
                         : arguments.apertures == "listing" ? optics::Apertures::listing
                                                            : optics::Apertures::none;
  Json rays = Json::array();
  for (const optics::RayRequest& request : optics::read_rays(source, lens)) {
    const optics::Assembly assembly(lens, request.elements);
    rays.push_back(optics::traced_to_json(request, optics::trace(assembly, request.ray, apertures)));
  }
  const Json result = {
      {"lens", lens.name}, {"units", "mm, degrees"}, {"apertures", arguments.apertures}, {"rays", rays}};
  print_result(result.dump(1) + "\n");
  return kDone;
}

}  // namespace

void add_lens(CLI::App& app, Context& context) {
  CLI::App& lens = add_verb(app, {"lens", "Inspect, trace, draw or convert a lens.",
                                  "relign-bench lens info --scene relign_od", "render, describe"});
  lens.require_subcommand(1);
  CLI::App& info_verb =
      add_verb(lens, {"info", "Print a lens: surfaces, first-order data with published values, distortion.",
                      "relign-bench lens info --scene relign_od\n"
                      "relign-bench lens info my_lens.zmx",
                      "lens draw, lens trace, scene new"});
  LensArguments& shown = add_action(info_verb, context, info);
  CLI::Option* file = info_verb.add_option(
      "LENSFILE", shown.lens_file,
      "lens file: relign-bench .json, Zemax .zmx, CODE V .seq or listing [default: the scene's lens]");
  info_verb.add_option("--scene", shown.scene, "scene whose lens to use: id, preset or path [default: relign_od]")
      ->type_name("SCENE")
      ->excludes(file);
  add_design_options(info_verb, shown.design);

  CLI::App& trace_verb = add_verb(
      lens, {"trace",
             "Trace rays from a JSON file through a lens in double precision; print hits, image points and exit "
             "directions.",
             "relign-bench lens trace rays.json --scene relign_od > traced.json\n"
             "  rays.json: {\"rays\": [{\"start_mm\": [0, 0.5, -1], \"direction\": [0, 0, 1]}]}",
             "lens info, render"});
  LensArguments& traced = add_action(trace_verb, context, trace_rays);
  trace_verb
      .add_option("RAYS", traced.rays,
                  "JSON file {\"rays\": [{\"start_mm\", \"direction\", \"elements\"}]}; mm, degrees")
      ->required();
  trace_verb.add_option("--scene", traced.scene, "scene whose lens to use: id, preset or path [default: relign_od]")
      ->type_name("SCENE");
  trace_verb
      .add_option("--apertures", traced.apertures,
                  "apertures that stop rays: none, mesh (the scene's semi-diameters) or listing (the design program's) "
                  "[default: none]")
      ->type_name("NAME")
      ->check(CLI::IsMember({"none", "mesh", "listing"}));
  add_lens_mesh(lens, context);
  add_lens_draw(lens, context);
}

}  // namespace relign::cli
