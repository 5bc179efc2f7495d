// lens_mesh: a scene of lens_system with elements as triangle meshes, traced with Embree. See README.md.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>

#include "base/error.h"
#include "base/files.h"
#include "base/hash.h"
#include "base/json_source.h"
#include "base/text.h"
#include "lens_scene/lens_scene.h"
#include "meshes/lens_meshes.h"
#include "meshes/mesh_file.h"
#include "meshes/mesh_writer.h"

namespace {

namespace fs = std::filesystem;
namespace imaging = relign::imaging;
namespace meshes = relign::meshes;
namespace optics = relign::optics;
using relign::Error;
using relign::ErrorKind;

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

// Parses "L1=lens_0.PLY, L2=lens_1.PLY".
std::map<std::string, std::string> read_names(const std::string& text) {
  std::map<std::string, std::string> names;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t to = std::min(text.find(',', from), text.size());
    const std::string part = text.substr(from, to - from);
    const std::size_t equals = part.find('=');
    const std::string name = trimmed(part.substr(0, equals));
    const std::string file = equals == std::string::npos ? "" : trimmed(part.substr(equals + 1));
    if (name.empty() || file.empty())
      throw Error(ErrorKind::bad_input, "parameter 'names': found '" + trimmed(part) +
                                            "', must be NAME=FILE, as in \"L1=lens_0.PLY, L2=lens_1.PLY\"");
    if (!names.emplace(name, file).second)
      throw Error(ErrorKind::bad_input, "parameter 'names': duplicate file for '" + name + "'");
    from = to + 1;
  }
  return names;
}

// Finds NAME.ply, NAME.stl or NAME.obj, extension in lower or upper case.
fs::path mesh_of(const std::string& name, const fs::path& folder) {
  for (const char* extension : {".ply", ".stl", ".obj", ".PLY", ".STL", ".OBJ"})
    if (const fs::path file = folder / (name + extension); fs::exists(file)) return file;
  throw Error(ErrorKind::bad_input, "no mesh of element '" + name + "' in '" + folder.string() + "'; must be " + name +
                                        ".ply, " + name + ".stl or " + name +
                                        ".obj, or named by parameter 'names' (\"" + name + "=FILE\")");
}

// The folder (empty: make meshes from the lens file) and the names of files that are not named after their element.
struct Source {
  std::string folder;
  std::map<std::string, std::string> names;
};

// "meshes": {"folder": "meshes", "files": {"L1": "lens_0.PLY"}} of a scene file.
Source source_of_file(const fs::path& file) {
  const relign::JsonSource source = relign::JsonSource::from_file(file);
  std::vector<relign::Problem> problems;
  relign::ObjectReader reader(source, "/meshes", problems);
  Source found;
  found.folder = (file.parent_path() / reader.required_string("folder")).string();
  if (const relign::Json* files = reader.get("files")) {
    relign::ObjectReader names(source, reader.pointer_to("files"), problems);
    if (files->is_object())
      for (const auto& item : files->items()) found.names[item.key()] = names.required_string(item.key());
  }
  reader.reject_unknown();
  relign::throw_if_any(problems);
  return found;
}

// Parameters take precedence over the scene file.
Source source_of(const relign::Parameters& given, const imaging::SceneFile& scene) {
  const Source own{given.text("meshes"), read_names(given.text("names"))};
  if (!own.folder.empty()) return own;
  if (!own.names.empty())
    throw Error(ErrorKind::bad_input, "parameter 'names' needs the folder of the files; set parameter 'meshes'");
  return scene.meshes.is_null() ? own : source_of_file(scene.files.front());
}

relign::lens_scene::Parts parts(const relign::Parameters& given) {
  relign::lens_scene::Parts parts = relign::lens_scene::read_parts(given);
  const auto [text, names] = source_of(given, parts.scene);
  std::map<std::string, meshes::Mesh> meshes;
  if (text.empty()) {
    const double pitch_mm = given.number("pitch_mm");
    for (const optics::Element& element : parts.scene.lens.elements)
      meshes[element.name] = meshes::element_mesh(element, pitch_mm);
    parts.tracer_hash = relign::shortest(pitch_mm);
  } else {
    const fs::path folder = text;
    if (!fs::is_directory(folder))
      throw Error(ErrorKind::bad_input, "parameter 'meshes': '" + text +
                                            "' is not a folder; must be one with a mesh of each element, as written by "
                                            "'relign-bench lens export-mesh -o FOLDER'");
    const auto add = [&](const std::string& name, const fs::path& file, meshes::Demand demand) {
      meshes[name] = meshes::read_mesh(file, demand);
      parts.tracer_hash += name + relign::sha256_file(file);
      parts.scene.files.push_back(file);
    };
    for (const optics::Element& element : parts.scene.lens.elements) {
      const auto named = names.find(element.name);
      add(element.name, named == names.end() ? mesh_of(element.name, folder) : folder / named->second,
          meshes::Demand::body);
    }
    for (const auto& [name, file] : names)
      if (meshes.count(name) == 0) add(name, folder / file, meshes::Demand::surface);
  }
  parts.tracer = std::make_unique<meshes::LensMeshes>(parts.scene.lens, meshes);
  return parts;
}

class LensMesh final : public relign::lens_scene::LensScene {
 public:
  explicit LensMesh(const relign::Parameters& given) : LensScene(given, parts(given), "lens_mesh.so") {}
};

}  // namespace

RELIGN_PLUGIN(LensMesh)
