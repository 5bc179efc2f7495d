// relign-bench completion: prints the shells' completion scripts. The scripts call the hidden verb `complete` for the
// completions at the cursor.
#include "base/error.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/complete.h"
#include "cli/completion_scripts.h"
#include "cli/shared_files.h"

namespace relign::cli {
namespace {

const char* script_of(const std::string& shell) {
  if (shell == "bash") return kBashScript;
  if (shell == "zsh") return kZshScript;
  if (shell == "fish") return kFishScript;
  throw Error(ErrorKind::bad_input, "unknown shell '" + shell + "'" + suggestion(shell, {"bash", "zsh", "fish"}));
}

bool is_of_kind(const std::string& kind, plugin_host::Kind plugin) {
  if (kind == "scenes") return plugin == plugin_host::Kind::scene;
  if (kind == "noise-levels") return plugin == plugin_host::Kind::noise_level;
  return kind.empty() || plugin_host::is_algorithm(plugin);
}

std::vector<Candidate> ids_of(Context& context, const std::string& kind, const std::vector<std::string>& plugins) {
  std::vector<Candidate> ids;
  if (kind == "suites") {
    for (const std::string& suite : installed_suites()) ids.push_back({suite, "installed suite"});
    return ids;
  }
  context.plugin_paths = plugins;
  for (const auto& plugin : context.catalog().plugins()) {
    if (!is_of_kind(kind, plugin->kind)) continue;
    ids.push_back({plugin->id, plugin->summary});
    for (const plugin_host::Preset& preset : plugin->presets) ids.push_back({preset.id, preset.summary});
  }
  return ids;
}

// One candidate per line, followed by a tab and its description; ":files" and ":folders" ask the shell for paths.
int print_candidates(Context& context, const CLI::App& program, const std::vector<std::string>& words) {
  const Candidates found =
      complete(program, words, [&](const auto& kind, const auto& plugins) { return ids_of(context, kind, plugins); });
  std::string text;
  for (const Candidate& candidate : found.words)
    text += candidate.word + (candidate.description.empty() ? "" : "\t" + candidate.description) + "\n";
  if (found.files) text += ":files\n";
  if (found.folders) text += ":folders\n";
  print_text(text);
  return kDone;
}

}  // namespace

void add_completion(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"completion", "Print a shell completion script for verbs, options and ids.",
                                  "relign-bench completion bash >> ~/.bashrc\n"
                                  "relign-bench completion zsh > \"${fpath[1]}/_relign-bench\"\n"
                                  "relign-bench completion fish > ~/.config/fish/completions/relign-bench.fish",
                                  "list, doctor"});
  auto shell = std::make_shared<std::string>();
  verb.add_option("SHELL", *shell, "shell: bash, zsh or fish")->required()->type_name("SHELL:{bash,zsh,fish}");
  verb.callback([&context, shell] {
    context.action = [shell] {
      print_result(script_of(*shell));
      return kDone;
    };
  });

  CLI::App* complete_verb = app.add_subcommand("complete", "Print the completions at the cursor.")->group("");
  auto words = std::make_shared<std::vector<std::string>>();
  complete_verb->add_option("WORD", *words, "words after the program's name, up to the cursor");
  complete_verb->callback([&app, &context, words] {
    context.action = [&app, &context, words] { return print_candidates(context, app, *words); };
  });
}

}  // namespace relign::cli
