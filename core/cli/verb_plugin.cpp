// relign-bench plugin new: creates a plugin project.
#include <filesystem>
#include <memory>

#include "base/error.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/scaffold.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

struct NewPluginArguments {
  std::string name;
  std::string kind;
  std::string language = "cpp";
  std::string observes = "images";
  std::string out;
  std::string onnx;
  std::string scene = "relign_od";
};

void refuse_taken_name(Context& context, plugin_host::Kind kind, const std::string& name) {
  for (const std::string& id : context.catalog().ids(kind))
    if (normalised_name(id) == normalised_name(name))
      throw Error(ErrorKind::bad_input, "plugin or preset '" + id + "' already exists; choose another name");
}

// The next commands, in order.
std::string next_steps(const NewPlugin& made) {
  const std::string folder = shell_quoted(made.folder.string());
  const bool python = made.language == "python";
  const std::string plugin = python ? "./" + made.name + ".py" : "./build/" + made.name;
  std::string arguments = "try ";
  if (made.observes != "images")
    arguments += "nlopt-neldermead --noise-level declared --protocol blind --scene ";
  else if (made.kind == "scene")
    arguments += "nlopt-sbplx --scene ";
  if (made.kind == "noise-level") arguments += "nlopt-sbplx --noise-level ";
  const std::string use = own_command_elsewhere(arguments + plugin);
  if (python) return "  cd " + folder + "\n  python3 test_" + made.name + ".py\n  " + use + "\n";
  const fs::path prefix = template_folder().parent_path().parent_path().parent_path();
  return "  cd " + folder + "\n  cmake -S . -B build -DCMAKE_PREFIX_PATH=" + shell_quoted(prefix.string()) +
         "\n  cmake --build build\n  ctest --test-dir build\n  " + use + "\n";
}

// Makes the plugin of a network. Its id is the path of its side file.
int new_network(Context& context, const NewPluginArguments& arguments) {
  if (arguments.kind != "agent")
    throw Error(ErrorKind::bad_input, "--onnx: requires --kind agent, found '" + arguments.kind + "'");
  const NewNetworkPlugin wanted{arguments.name, arguments.onnx, arguments.scene,
                                arguments.out.empty() ? arguments.name : arguments.out};
  if (!context.extensions.write_network_plugin)
    throw Error(ErrorKind::bad_input, "--onnx: this program was built without the component 'training'");
  context.extensions.write_network_plugin(context, wanted);
  const fs::path side_file = wanted.folder / (wanted.name + ".json");
  if (context.json)
    print_result(Json{{"id", wanted.name},
                      {"kind", "agent"},
                      {"language", "onnx"},
                      {"folder", fs::absolute(wanted.folder).lexically_normal().string()}}
                     .dump(2) +
                 "\n");
  else
    print_result(wanted.folder.string() + "\n");
  std::fprintf(
      stderr, "Next: fill in normalisation and output in %s (README.md beside it), then\n  %s\n", side_file.c_str(),
      own_command("try " + shell_quoted(side_file.string()) + " --scene " + shell_quoted(wanted.scene)).c_str());
  return kDone;
}

int new_plugin(Context& context, const NewPluginArguments& arguments) {
  const auto kind = plugin_host::kind_from_name(arguments.kind);
  if (!kind)
    throw Error(ErrorKind::bad_input, "unknown kind '" + arguments.kind + "'" +
                                          suggestion(arguments.kind, {"optimizer", "agent", "scene", "noise-level"}));
  const NewPlugin wanted{plugin_host::kind_name(*kind), arguments.language, arguments.name,
                         arguments.out.empty() ? arguments.name : arguments.out, arguments.observes};
  if (arguments.observes != "images" && (*kind != plugin_host::Kind::scene || arguments.language != "python"))
    throw Error(ErrorKind::bad_input, "--observes " + arguments.observes + ": requires --kind scene --lang python");
  if (const std::string wrong = check_plugin_name(wanted.name); !wrong.empty())
    throw Error(ErrorKind::bad_input, wrong);
  refuse_taken_name(context, *kind, wanted.name);
  if (!arguments.onnx.empty()) return new_network(context, arguments);
  write_project(template_folder(), wanted);
  if (context.json) {
    print_result(Json{{"id", wanted.name},
                      {"kind", wanted.kind},
                      {"language", wanted.language},
                      {"folder", fs::absolute(wanted.folder).lexically_normal().string()}}
                     .dump(2) +
                 "\n");
    return kDone;
  }
  print_result(wanted.folder.string() + "\n");
  std::fprintf(stderr, "Next:\n%s", next_steps(wanted).c_str());
  return kDone;
}

void add_new(CLI::App& plugin, Context& context) {
  CLI::App& verb = add_verb(
      plugin, {"new", "Create a small, complete plugin project, or with --onnx an agent that follows your network.",
               "relign-bench plugin new --kind optimizer my_search\n"
               "relign-bench plugin new --kind scene --lang python --observes readings my_coupler\n"
               "relign-bench plugin new --kind agent --onnx my_net.onnx my_net",
               "plugin check, try, describe"});
  NewPluginArguments& arguments = add_action(verb, context, new_plugin);
  verb.add_option("NAME", arguments.name, "id of the plugin: letters, digits, '-', '_' or '.'")->required();
  verb.add_option("--kind", arguments.kind, "kind of plugin: optimizer, agent, scene or noise-level; required")
      ->type_name("KIND:{optimizer,agent,scene,noise-level}")
      ->required();
  verb.add_option("--lang", arguments.language, "language: cpp or python")
      ->type_name("LANGUAGE")
      ->check(CLI::IsMember({"cpp", "python"}))
      ->capture_default_str();
  verb.add_option("--observes", arguments.observes, "of a scene: images, readings of instruments, or both (Python)")
      ->type_name("WHAT")
      ->check(CLI::IsMember({"images", "readings", "both"}))
      ->capture_default_str();
  verb.add_option("-o,--out", arguments.out, "folder to create; must not exist [default: NAME]")->type_name("DIR");
  CLI::Option* onnx =
      verb.add_option("--onnx", arguments.onnx,
                      "with --kind agent: ONNX network from images to moves, which is copied and gets a side file")
          ->type_name("FILE")
          ->excludes(verb.get_option("--lang"));
  verb.add_option("--scene", arguments.scene, "with --onnx: scene that the network is for: id, preset or path")
      ->type_name("SCENE")
      ->capture_default_str()
      ->needs(onnx);
}

}  // namespace

void add_plugin(CLI::App& app, Context& context) {
  CLI::App& plugin = add_verb(app, {"plugin", "Create, check and pretrain plugins.",
                                    "relign-bench plugin new --kind optimizer my_search", "list, describe, try"});
  plugin.require_subcommand(1);
  add_new(plugin, context);
  add_plugin_check(plugin, context);
  add_plugin_prepare(plugin, context);
}

}  // namespace relign::cli
