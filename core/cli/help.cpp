#include "cli/help.h"

#include <sstream>
#include <string>
#include <vector>

#include "base/text.h"

namespace relign::cli {

constexpr std::size_t kLeftColumn = 26;
constexpr std::size_t kLineWidth = 100;

std::string wrapped(const std::string& text, std::size_t indent) {
  std::istringstream words(text);
  std::string word, lines;
  std::size_t column = indent;
  while (words >> word) {
    if (column > indent && column + 1 + word.size() > kLineWidth) {
      lines += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (column > indent) {
      lines += " ";
      ++column;
    }
    lines += word;
    column += word.size();
  }
  return lines;
}

void add_row(std::string& text, const std::string& left, const std::string& right) {
  std::string row = "  " + left;
  if (row.size() + 2 > kLeftColumn) {
    text += row + "\n" + std::string(kLeftColumn, ' ');
  } else {
    row.resize(kLeftColumn, ' ');
    text += row;
  }
  text += wrapped(right, kLeftColumn) + "\n";
}

namespace {

std::string option_names(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  std::string text = join(names, ", ");
  // Without the allowed values that CLI11's validators append; the descriptions list them.
  const std::string type = option.get_type_name();
  if (!type.empty() && option.get_expected_max() > 0) text += " " + type.substr(0, type.find(':'));
  return text;
}

std::string option_text(const CLI::Option& option) {
  std::string text = option.get_description();
  if (!option.get_default_str().empty()) text += " [default: " + option.get_default_str() + "]";
  return text;
}

class HelpFormatter : public CLI::FormatterBase {
 public:
  std::string make_help(const CLI::App* app, std::string /*name*/, CLI::AppFormatMode /*mode*/) const override {
    const CLI::App* root = app;
    std::string path = app->get_name();
    while (root->get_parent() != nullptr) {
      root = root->get_parent();
      path = root->get_name() + " " + path;
    }
    const auto verbs = app->get_subcommands(
        [](const CLI::App* verb) { return !verb->get_name().empty() && !verb->get_group().empty(); });
    const auto positionals = app->get_options([](const CLI::Option* option) { return option->get_positional(); });
    // Options without a group are internal.
    const auto is_named = [](const CLI::Option* option) {
      return !option->get_positional() && !option->get_group().empty();
    };

    std::string text = "Usage: " + path + (verbs.empty() ? "" : " VERB") + " [options]";
    for (const CLI::Option* option : positionals) {
      const std::string many = option->get_expected_max() > 1 ? "..." : "";
      text += option->get_required() ? " " + option->get_name(true) + many : " [" + option->get_name(true) + many + "]";
    }
    text += "\n\n" + wrapped(app->get_description(), 0) + "\n";

    if (!verbs.empty()) {
      text += "\nVerbs:\n";
      for (const CLI::App* verb : verbs) add_row(text, verb->get_name(), verb->get_description());
    }
    if (!positionals.empty()) {
      text += "\nArguments:\n";
      for (const CLI::Option* option : positionals) add_row(text, option->get_name(true), option_text(*option));
    }
    const auto named = app->get_options(is_named);
    if (!named.empty()) {
      text += "\nOptions:\n";
      for (const CLI::Option* option : named) add_row(text, option_names(*option), option_text(*option));
    }
    if (root != app) {
      text += "\nGlobal options:\n";
      for (const CLI::Option* option : root->get_options(is_named))
        if (option != root->get_help_ptr()) add_row(text, option_names(*option), option_text(*option));
    }
    if (!app->get_footer().empty()) text += "\n" + app->get_footer() + "\n";
    return text;
  }
};

}  // namespace

std::shared_ptr<CLI::FormatterBase> help_formatter() { return std::make_shared<HelpFormatter>(); }

}  // namespace relign::cli
