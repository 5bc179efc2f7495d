// relign-bench lens export-mesh and lens fit-mesh: converts lenses to triangle meshes and back.
#include <algorithm>
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/text_table.h"
#include "lens_verbs/extensions.h"
#include "lens_verbs/lens_files.h"
#if RELIGN_HAS_MESHES
#include "meshes/lens_fit.h"
#include "meshes/mesh_file.h"
#include "meshes/mesh_writer.h"
#endif

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct MeshArguments {
  std::string scene = "relign_od";
  double pitch_mm = 0.1;
  std::string output;
  std::vector<std::string> files;
};

#if RELIGN_HAS_MESHES

int export_meshes(Context& context, const MeshArguments& arguments) {
  const optics::Prescription lens = lens_of(context, arguments.scene);
  Json written = Json::array();
  TextTable table({"file", "triangles", "corners"});
  for (const optics::Element& element : lens.elements) {
    const meshes::Mesh made = meshes::element_mesh(element, arguments.pitch_mm);
    const fs::path file = fs::path(arguments.output) / (element.name + ".ply");
    write_file_atomically(file, meshes::ply_of(made));
    table.add({file.string(), std::to_string(made.triangles.size()), std::to_string(made.vertices.size())});
    written.push_back({{"element", element.name},
                       {"file", file.string()},
                       {"triangles", made.triangles.size()},
                       {"corners", made.vertices.size()}});
  }
  print_result(context.json ? written.dump(2) + "\n" : table.text());
  return kDone;
}

struct Fit {
  std::string file;
  meshes::FittedElement element;
};

// A face counts as plane if its slope at the rim is below 1e-7 rad: a radius of 30 km for a semi-diameter of 3 mm.
bool is_plane(const meshes::FittedFace& face) { return std::fabs(face.curvature) * face.clear_radius_mm < 1e-7; }

Json radius_of(const meshes::FittedFace& face) { return is_plane(face) ? Json() : Json(1 / face.curvature); }

std::string table_of(const std::vector<Fit>& fits) {
  TextTable table({"face", "z mm", "radius mm", "semi-diameter mm", "tilt x, y deg", "residual rms um", "largest um"});
  for (const Fit& fit : fits)
    for (const meshes::FittedFace* face : {&fit.element.front, &fit.element.back})
      table.add({fs::path(fit.file).filename().string() + (face == &fit.element.front ? " front" : " back"),
                 fixed(face->z_mm, 6), is_plane(*face) ? "plane" : fixed(1 / face->curvature, 5),
                 fixed(face->clear_radius_mm, 4), fixed(face->tilt_deg[0], 4) + ", " + fixed(face->tilt_deg[1], 4),
                 fixed(1000 * face->residual_rms_mm, 4), fixed(1000 * face->residual_largest_mm, 4)});
  return table.text();
}

Json json_of(const meshes::FittedFace& face) {
  return {{"z_mm", face.z_mm},
          {"radius_mm", radius_of(face)},
          {"clear_radius_mm", face.clear_radius_mm},
          {"tilt_deg", face.tilt_deg},
          {"residual_rms_mm", face.residual_rms_mm},
          {"residual_largest_mm", face.residual_largest_mm},
          {"corners", face.corners}};
}

// The lens file `like` with its faces replaced by the fitted spheres. Meshes lack indices, stops and image plane.
std::string lens_file_of(const std::vector<Fit>& fits, const fs::path& like) {
  const JsonSource source = JsonSource::from_file(like);
  const optics::Prescription lens = optics::read_prescription(source);
  if (lens.elements.size() != fits.size())
    throw Error(ErrorKind::bad_input, "the lens of '" + like.string() + "' has " +
                                          std::to_string(lens.elements.size()) +
                                          " elements, but the number of meshes is " + std::to_string(fits.size()) +
                                          "; -o needs one mesh per element, in any order");
  Json root = source.root();
  root["source"] = "spheres fitted to meshes; all else of " + lens.name;
  root.erase("published");
  for (std::size_t e = 0; e < fits.size(); ++e) {
    root.at("elements").at(e).erase("placement");
    Json& faces = root.at("elements").at(e).at("faces");
    if (faces.size() != 2)
      throw Error(ErrorKind::bad_input, "element '" + lens.elements[e].name + "' of '" + like.string() + "' has " +
                                            std::to_string(faces.size()) + " faces; meshes are fitted with two");
    for (const auto& [at, face] : {std::pair{0, &fits[e].element.front}, {1, &fits[e].element.back}}) {
      Json& into = faces.at(static_cast<std::size_t>(at));
      into["z_mm"] = face->z_mm;
      into["radius_mm"] = radius_of(*face);
      into["clear_radius_mm"] = face->clear_radius_mm;
      for (const char* not_fitted : {"listing_clear_radius_mm", "conic", "even_asphere"}) into.erase(not_fitted);
    }
  }
  const std::string text = root.dump(2) + "\n";
  optics::read_prescription(JsonSource::from_text(text, "the fitted lens"));
  return text;
}

int fit_meshes(Context& context, const MeshArguments& arguments) {
  std::vector<Fit> fits;
  for (const std::string& file : arguments.files)
    fits.push_back({file, meshes::fit_element(meshes::read_mesh(file, meshes::Demand::body), file)});
  std::stable_sort(fits.begin(), fits.end(),
                   [](const Fit& a, const Fit& b) { return a.element.front.z_mm < b.element.front.z_mm; });
  if (!arguments.output.empty())
    write_file_atomically(arguments.output, lens_file_of(fits, lens_file_of_scene(context, arguments.scene)));
  if (context.json) {
    Json elements = Json::array();
    for (const Fit& fit : fits)
      elements.push_back({{"file", fit.file}, {"faces", {json_of(fit.element.front), json_of(fit.element.back)}}});
    Json result = {{"elements", elements}};
    if (!arguments.output.empty()) result["lens"] = arguments.output;
    print_result(result.dump(2) + "\n");
  } else {
    print_result(table_of(fits) + (arguments.output.empty() ? "" : arguments.output + "\n"));
  }
  return kDone;
}

#else

[[noreturn]] int no_mesh_support() {
  throw Error(ErrorKind::bad_input,
              "this program was built without mesh support; install assimp and Embree 3 (Debian and Ubuntu: "
              "libassimp-dev libembree-dev) and rebuild");
}
int export_meshes(Context&, const MeshArguments&) { no_mesh_support(); }
int fit_meshes(Context&, const MeshArguments&) { no_mesh_support(); }

#endif

}  // namespace

void add_lens_mesh(CLI::App& lens, Context& context) {
  CLI::App& export_verb = add_verb(
      lens, {"export-mesh", "Export each element of a lens as a closed triangle mesh in a PLY file.",
             "relign-bench lens export-mesh --scene relign_od --pitch 0.1 -o meshes", "lens fit-mesh, render"});
  MeshArguments& exported = add_action(export_verb, context, export_meshes);
  export_verb.add_option("--scene", exported.scene, "scene whose lens to use: id, preset or path [default: relign_od]")
      ->type_name("SCENE");
  export_verb.add_option("--pitch", exported.pitch_mm, "edge length of the triangles, mm [default: 0.1]")
      ->type_name("MM")
      ->check(CLI::Range(1e-4, 1e3));
  export_verb.add_option("-o,--out", exported.output, "folder for L1.ply, L2.ply, ..., in lens coordinates, mm")
      ->type_name("DIR")
      ->required();

  CLI::App& fit_verb = add_verb(
      lens, {"fit-mesh", "Fit spheres to meshes of lens elements; print the prescription and the residuals.",
             "relign-bench lens fit-mesh meshes/*.ply --scene relign_od -o lens.json", "lens export-mesh, lens info"});
  MeshArguments& fitted = add_action(fit_verb, context, fit_meshes);
  fit_verb
      .add_option("FILE", fitted.files, "one mesh per element (PLY, STL or OBJ): closed, centred on the z axis, mm")
      ->required();
  fit_verb
      .add_option("--scene", fitted.scene,
                  "scene whose lens file provides indices, stops, barrel and image plane for -o [default: relign_od]")
      ->type_name("SCENE");
  fit_verb.add_option("-o,--out", fitted.output, "also write the fitted lens to this lens file")->type_name("FILE");
}

}  // namespace relign::cli
