#include "cli/scaffold.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "cli/new_folder.h"
#include "cli/shared_files.h"

namespace relign::cli {
namespace fs = std::filesystem;

namespace {

const char* const kTemplateName = "my_plugin";
const char* const kTemplateClass = "MyPlugin";

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_word(char c) { return is_letter(c) || is_digit(c) || c == '_'; }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

bool has_word(const std::string& text, const std::string& word) {
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !is_word(text[at - 1])) && (end == text.size() || !is_word(text[end]))) return true;
  }
  return false;
}

NewFiles read_template(const fs::path& folder) {
  NewFiles files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.emplace_back(entry.path().lexically_relative(folder), read_file(entry.path()));
  return files;
}

void rename_plugin(NewFiles& files, const std::string& name) {
  // The class of a plugin called "policy" must not collide with a class of the template.
  std::string its_class = class_name(name);
  const auto taken = [&](const auto& file) { return has_word(file.second, its_class); };
  while (std::any_of(files.begin(), files.end(), taken)) its_class += "Plugin";
  for (auto& [path, text] : files) {
    text = replaced(replaced(text, kTemplateClass, its_class), kTemplateName, name);
    path = replaced(path.string(), kTemplateName, name);
  }
}

}  // namespace

fs::path template_folder() {
  std::error_code error;
  const fs::path folder = shared_folder("templates");
  if (!fs::is_directory(folder, error))
    throw Error(ErrorKind::io,
                "no templates in '" + folder.string() + "'; reinstall this program with 'cmake --install'");
  return folder;
}

std::vector<std::string> known_templates(const fs::path& templates) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(templates)) {
    const std::string name = entry.path().filename().string();
    const std::size_t dash = name.rfind('-');
    if (entry.is_directory() && dash != std::string::npos)
      names.push_back(name.substr(0, dash) + " in " + name.substr(dash + 1));
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string check_plugin_name(const std::string& name) {
  const auto allowed = [](char c) { return is_word(c) || c == '-' || c == '.'; };
  if (!name.empty() && name.size() <= 64 && is_letter(name[0]) && std::all_of(name.begin(), name.end(), allowed))
    return "";
  return "invalid plugin name '" + name +
         "'; allowed: 1 to 64 letters, digits, '-', '_' or '.', starting with a letter";
}

std::string class_name(const std::string& name) {
  std::string text;
  bool begins = true;
  for (const char c : name) {
    const bool part = is_letter(c) || is_digit(c);
    if (part) text += begins && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    begins = !part;
  }
  return text;
}

void write_project(const fs::path& templates, const NewPlugin& wanted) {
  if (const std::string wrong = check_plugin_name(wanted.name); !wrong.empty())
    throw Error(ErrorKind::bad_input, wrong);
  const fs::path source =
      templates / (wanted.kind + (wanted.observes == "images" ? "" : "-" + wanted.observes) + "-" + wanted.language);
  if (!fs::is_directory(source))
    throw Error(ErrorKind::bad_input, "no template for " + wanted.kind + " in " + wanted.language +
                                          "; available: " + join(known_templates(templates), ", "));
  NewFolder folder(wanted.folder);
  NewFiles files = read_template(source);
  rename_plugin(files, wanted.name);
  folder.write(files);
  folder.keep();
}

}  // namespace relign::cli
