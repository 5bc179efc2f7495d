#include "network_plugin/network_plugin.h"

#include "base/error.h"
#include "base/files.h"
#include "base/hash.h"
#include "base/machine.h"
#include "base/shell_words.h"
#include "cli/new_folder.h"
#include "cli/scaffold.h"
#include "cli/workbench.h"
#include "policies/model.hpp"
#include "policies/new_side_file.hpp"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxNetworkBytes = std::size_t{256} << 20;

std::string command_of(const NewNetworkPlugin& wanted) {
  return "relign-bench plugin new --kind agent --onnx " + shell_quoted(fs::path(wanted.onnx).filename().string()) +
         " --scene " + shell_quoted(wanted.scene) + " " + shell_quoted(wanted.name);
}

std::string readme(const NewNetworkPlugin& wanted) {
  const std::string side = wanted.name + ".json";
  return "# " + wanted.name + "\n\nAn agent that follows the network `" + wanted.name + ".onnx`, for scene `" +
         wanted.scene + "`.\n\nFill in `" + side +
         "`:\n\n"
         "| key | meaning | now |\n|---|---|---|\n"
         "| `observation.mean`, `observation.deviation` | the network's input is (byte - mean) / deviation; 255 for "
         "inputs from 0 to 1 | 0, 1 |\n"
         "| `observation.byte_whites` | byte 255 is this multiple of a lit pixel's value | 3 |\n"
         "| `output` | `way`: displacement to the optimum; `move`: the next move | `way` |\n"
         "| `scales` | factor of each output that makes it a share of the axis's travel | 1 |\n"
         "| `trained` | `{\"hours\": 3, \"steps\": 100000, \"machine\": \"one GPU\"}`, the cost that reports show | "
         "absent "
         "|\n\nThen:\n\n```sh\nrelign-bench try " +
         shell_quoted(side) + " --scene " + shell_quoted(wanted.scene) +
         " --steps 8\n```\n\nSuites accept the path of the side file wherever they accept an algorithm. `parity` "
         "(inputs of the network with its outputs) does not depend on these keys. After a new export, run\n`" +
         command_of(wanted) + "` again.\n";
}

std::string side_file(Context& context, const NewNetworkPlugin& wanted, const std::string& bytes) {
  const LoadedScene scene =
      load_scene(named_choice(context.catalog(), plugin_host::Kind::scene, wanted.scene, "--scene"),
                 context.services(core_count()));
  std::vector<std::string> axes;
  for (const trials::Axis& axis : scene.facts.axes) axes.push_back(axis.name);
  const policies::TargetScene target{wanted.scene, std::move(axes), scene.facts.image_white,
                                     ImageView(scene.scene->reference())};
  return policies::new_side_file(bytes, sha256_hex(bytes), target, command_of(wanted));
}

}  // namespace

void write_network_plugin(Context& context, const NewNetworkPlugin& wanted) {
  if (const std::string wrong = check_plugin_name(wanted.name); !wrong.empty())
    throw Error(ErrorKind::bad_input, wrong);
  const std::string bytes = read_file(wanted.onnx, kMaxNetworkBytes);
  NewFolder folder(wanted.folder);
  try {
    const fs::path draft = folder.write({{wanted.name + ".onnx", bytes},
                                         {wanted.name + ".json", side_file(context, wanted, bytes)},
                                         {"README.md", readme(wanted)}});
    const policies::Model loads((draft / (wanted.name + ".onnx")).string());  // as the agent will load it
  } catch (const Error&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw Error(ErrorKind::bad_input, "--onnx: '" + wanted.onnx + "': " + error.what());
  }
  folder.keep();
}

}  // namespace relign::cli
