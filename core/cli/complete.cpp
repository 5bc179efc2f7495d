#include "cli/complete.h"

#include <map>
#include <set>

#include "base/text.h"

namespace relign::cli {
namespace {

// Completions by the name of the value in the help; other values are numbers and free text.
const std::map<std::string, std::string> kIds = {
    {"SCENE", "scenes"}, {"LEVEL", "noise-levels"}, {"ALGORITHM", "algorithms"}, {"ID", ""}, {"SUITE", "suites"}};
const std::set<std::string> kFiles = {"FILE", "PATH", "LENSFILE", "RAYS", "SUITE"};
const std::set<std::string> kFolders = {"DIR", "FOLDER", "A", "B"};

bool begins_with(const std::string& text, const std::string& beginning) {
  return text.compare(0, beginning.size(), beginning) == 0;
}

// The verb's own option or the program's: global options may follow the verb.
const CLI::Option* find_option(const CLI::App* verb, const std::string& name) {
  for (; verb != nullptr; verb = verb->get_parent())
    if (const CLI::Option* option = verb->get_option_no_throw(name)) return option;
  return nullptr;
}

const CLI::App* find_verb(const CLI::App& parent, const std::string& name) {
  for (const CLI::App* verb : parent.get_subcommands([](const CLI::App*) { return true; }))
    if (verb->get_name() == name) return verb;
  return nullptr;
}

// The words up to the cursor, parsed as far as completion needs.
struct Line {
  const CLI::App* verb = nullptr;
  const CLI::Option* open = nullptr;  // option that expects a value
  std::size_t arguments = 0;          // positional arguments so far
  bool only_arguments = false;        // after --
  std::vector<std::string> plugins;   // values of --plugin
};

void take_value(Line& line, const CLI::Option& option, const std::string& value) {
  if (option.check_lname("plugin")) line.plugins.push_back(value);
}

void take_option(Line& line, const std::string& word) {
  const std::size_t equals = word.find('=');
  const CLI::Option* option = find_option(line.verb, word.substr(0, equals));
  if (option == nullptr || option->get_expected_max() == 0) return;
  if (equals == std::string::npos)
    line.open = option;
  else
    take_value(line, *option, word.substr(equals + 1));
}

Line parse_line(const CLI::App& program, const std::vector<std::string>& words) {
  Line line;
  line.verb = &program;
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    const std::string& word = words[i];
    if (line.open != nullptr) {
      if (word == "=") continue;  // bash splits --option=value at '='
      take_value(line, *line.open, word);
      line.open = nullptr;
    } else if (line.only_arguments || word.empty() || word == "-" || word.front() != '-') {
      const CLI::App* verb = line.only_arguments || line.arguments > 0 ? nullptr : find_verb(*line.verb, word);
      if (verb != nullptr)
        line.verb = verb;
      else
        ++line.arguments;
    } else if (word == "--") {
      line.only_arguments = true;
    } else {
      take_option(line, word);
    }
  }
  return line;
}

void add(Candidates& found, const std::string& typed, const Candidate& candidate) {
  if (begins_with(candidate.word, typed)) found.words.push_back(candidate);
}

// The words in braces of "MODE:{auto,plain}". CLI11's list validator appends them to the type name; some verbs add them
// by hand.
std::vector<std::string> allowed_words(const std::string& type) {
  const std::size_t open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos || close < open) return {};
  std::vector<std::string> words;
  std::string word;
  for (std::size_t i = open + 1; i <= close; ++i) {
    if (type[i] != ',' && i != close) {
      word += type[i];
      continue;
    }
    words.push_back(word);
    word.clear();
  }
  return words;
}

// `before` is the "--option=" of the current word, or empty.
void add_values(Candidates& found, const CLI::Option& option, const std::string& before, const std::string& typed,
                const std::vector<std::string>& plugins, const IdSource& ids) {
  const std::string type = option.get_type_name();
  std::string name = type.substr(0, type.find(':'));
  if (option.get_positional() && (name.empty() || name == "TEXT")) name = option.get_name(true);
  for (const std::string& word : allowed_words(type)) add(found, before + typed, {before + word, ""});
  if (const auto kind = kIds.find(name); kind != kIds.end()) {
    for (const Candidate& id : ids(kind->second, plugins))
      add(found, before + typed, {before + id.word, id.description});
    // Paths are allowed wherever ids are; files are offered once the word looks like a path.
    found.files = typed.find('/') != std::string::npos || begins_with(typed, ".") || begins_with(typed, "~");
  }
  found.files = found.files || kFiles.count(name) > 0;
  found.folders = kFolders.count(name) > 0;
}

void add_options(Candidates& found, const Line& line, const std::string& typed) {
  std::set<std::string> seen;
  for (const CLI::App* verb = line.verb; verb != nullptr; verb = verb->get_parent())
    for (const CLI::Option* option : verb->get_options()) {
      if (option->get_positional() || option->get_group().empty()) continue;
      for (const std::string& name : option->get_lnames())
        if (seen.insert(name).second) add(found, typed, {"--" + name, option->get_description()});
    }
}

void add_argument(Candidates& found, const Line& line, const std::string& typed, const IdSource& ids) {
  const auto arguments = line.verb->get_options([](const CLI::Option* option) { return option->get_positional(); });
  if (arguments.empty()) return;
  const bool beyond = line.arguments >= arguments.size();
  if (beyond && arguments.back()->get_expected_max() <= 1) return;
  const CLI::Option* option = beyond ? arguments.back() : arguments[line.arguments];
  add_values(found, *option, "", typed, line.plugins, ids);
}

}  // namespace

Candidates complete(const CLI::App& program, const std::vector<std::string>& words, const IdSource& ids) {
  Candidates found;
  const Line line = parse_line(program, words);
  const std::string typed = words.empty() ? "" : words.back();
  if (line.open != nullptr) {
    add_values(found, *line.open, "", typed == "=" ? "" : typed, line.plugins, ids);
  } else if (!line.only_arguments && begins_with(typed, "-")) {
    const std::size_t equals = typed.find('=');
    const CLI::Option* option = equals == std::string::npos ? nullptr : find_option(line.verb, typed.substr(0, equals));
    if (option != nullptr)
      add_values(found, *option, typed.substr(0, equals + 1), typed.substr(equals + 1), line.plugins, ids);
    else
      add_options(found, line, typed);
  } else {
    if (line.arguments == 0 && !line.only_arguments)
      for (const CLI::App* verb : line.verb->get_subcommands([](const CLI::App*) { return true; }))
        if (!verb->get_group().empty()) add(found, typed, {verb->get_name(), verb->get_description()});
    add_argument(found, line, typed, ids);
  }
  return found;
}

}  // namespace relign::cli
