#include "arrows/arrows.h"

#include <algorithm>
#include <fstream>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace relign::arrows {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string room_of(const std::string& place) { return place.substr(0, place.find('/')); }

// A folder whose files may include each other, and the left side that stands for it in the table.
struct Unit {
  fs::path folder;
  std::string room;
};

std::vector<Unit> units_of(const fs::path& root) {
  std::vector<Unit> units;
  const auto each_folder = [](const fs::path& folder, const auto& use) {
    if (!fs::is_directory(folder)) return;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder))
      if (entry.is_directory()) use(entry.path());
  };
  each_folder(root / "core", [&](const fs::path& room) { units.push_back({room, room.filename().string()}); });
  each_folder(root / "plugins", [&](const fs::path& kind) {
    if (fs::exists(kind / "CMakeLists.txt")) {  // no kind of plugin: a library that several of them share
      units.push_back({kind, kind.filename().string()});
      return;
    }
    each_folder(kind, [&](const fs::path& plugin) { units.push_back({plugin, kind.filename().string()}); });
  });
  each_folder(root / "examples", [&](const fs::path& example) { units.push_back({example, "examples"}); });
  return units;
}

bool is_inside(const fs::path& file, const fs::path& folder) {
  const fs::path relative = file.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

// Tests beside a plugin are no part of it.
bool is_test(const fs::path& file, const fs::path& unit) {
  for (const fs::path& part : file.lexically_relative(unit).parent_path())
    if (part == "tests" || part == "test") return true;
  const std::string stem = file.stem().string();
  return stem.size() >= 5 && stem.compare(stem.size() - 5, 5, "_test") == 0;
}

class Checker {
 public:
  Checker(fs::path root, const Arrows& arrows) : root_(std::move(root)), arrows_(arrows) {}

  std::vector<std::string> run() {
    for (const Unit& unit : units_of(root_)) {
      if (!arrows_.knows_room(unit.room)) {
        wrong_.push_back(shown(unit.folder) + ": '" + unit.room + "' has no line in core/arrows.txt");
        continue;
      }
      for (const fs::directory_entry& entry : fs::recursive_directory_iterator(unit.folder)) {
        if (!entry.is_regular_file() || is_test(entry.path(), unit.folder)) continue;
        static const std::set<std::string> kSources = {".h", ".hpp", ".c", ".cpp", ".inc"};
        if (kSources.count(entry.path().extension().string()) > 0) check_includes(unit, entry.path());
        if (entry.path().filename() == "CMakeLists.txt") check_links(unit, entry.path());
      }
    }
    std::sort(wrong_.begin(), wrong_.end());
    return wrong_;
  }

 private:
  std::string shown(const fs::path& file) const { return file.lexically_relative(root_).generic_string(); }

  // "optics/trace.h" for a header of ours; empty for one of this unit, or of somebody else.
  std::string place_of(const Unit& unit, const fs::path& file, const std::string& header) const {
    const fs::path beside = (file.parent_path() / header).lexically_normal();
    if (fs::exists(beside)) {
      if (is_inside(beside, unit.folder)) return "";
      return is_inside(beside, root_ / "core") ? beside.lexically_relative(root_ / "core").generic_string()
                                               : shown(beside);
    }
    if (header.compare(0, 7, "relign/") == 0) return "plugin_api/" + header;
    const std::string first = room_of(header);
    if (first == header) return "";
    if (!arrows_.knows_room(first) && !fs::is_directory(root_ / "core" / first)) return "";
    return header;
  }

  void check_includes(const Unit& unit, const fs::path& file) {
    static const std::regex include(R"re(^[ \t]*#[ \t]*include[ \t]*[<"]([^>"]+)[>"])re");
    const bool in_core = is_inside(file, root_ / "core");
    const std::string left =
        in_core ? file.lexically_relative(root_ / "core").generic_string() : unit.room + "/" + file.filename().string();
    std::istringstream lines(read(file));
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
      std::smatch match;
      if (!std::regex_search(line, match, include)) continue;
      const std::string place = place_of(unit, file, match[1]);
      if (place.empty() || (in_core && room_of(place) == unit.room)) continue;
      if (!arrows_.allows_include(unit.room, left, place))
        wrong_.push_back(shown(file) + ":" + std::to_string(number) + ": " + unit.room + " must not include " + place);
    }
  }

  void check_links(const Unit& unit, const fs::path& file) {
    static const std::regex call(R"((relign_add_room|relign_add_plugin|target_link_libraries)[ \t]*\(([^)]*)\))");
    static const std::regex comment("#[^\n]*");
    const std::string text = std::regex_replace(read(file), comment, "");
    for (auto match = std::sregex_iterator(text.begin(), text.end(), call); match != std::sregex_iterator(); ++match) {
      std::istringstream words((*match)[2].str());
      std::string word;
      words >> word;  // the target itself
      if (word.compare(0, 5, "test_") == 0) continue;
      while (words >> word) {
        std::string room = word == "relign::plugin_api" ? "plugin_api" : "";
        if (word.compare(0, 7, "relign_") == 0) room = word.substr(7);
        if (room.empty() || room == unit.room || !arrows_.knows_room(room)) continue;
        if (!arrows_.allows_link(unit.room, room))
          wrong_.push_back(shown(file) + ": " + unit.room + " must not link " + word);
      }
    }
  }

  const fs::path root_;
  const Arrows& arrows_;
  std::vector<std::string> wrong_;
};

}  // namespace

Arrows::Arrows(const std::string& table) {
  std::istringstream lines(table);
  std::string line;
  while (std::getline(lines, line)) {
    line.erase(std::min(line.find('#'), line.size()));
    std::istringstream words(line);
    std::string left, arrow, right;
    if (!(words >> left)) continue;
    if (!(words >> arrow) || arrow != "->") throw std::runtime_error("no arrow in the line '" + line + "'");
    std::vector<std::string>& targets = direct_[left];
    while (words >> right) {
      targets.push_back(right);
      pointed_at_.insert(room_of(right));
    }
    if (targets.empty()) throw std::runtime_error("nothing right of the arrow in '" + line + "'");
  }
}

std::set<std::string> Arrows::reachable(const std::string& left) const {
  std::set<std::string> found;
  std::vector<std::string> open = {left};
  while (!open.empty()) {
    const auto line = direct_.find(open.back());
    open.pop_back();
    if (line == direct_.end()) continue;
    for (const std::string& target : line->second) {
      const bool is_room = target.find('/') == std::string::npos;
      if (found.insert(target).second && is_room) open.push_back(target);
    }
  }
  return found;
}

bool Arrows::allows_include(const std::string& room, const std::string& file, const std::string& header) const {
  for (const std::string& left : {room, file}) {
    const std::set<std::string> allowed = reachable(left);
    if (allowed.count(header) > 0 || allowed.count(room_of(header)) > 0) return true;
  }
  return false;
}

bool Arrows::allows_link(const std::string& room, const std::string& other) const {
  for (const auto& [left, targets] : direct_) {
    if (room_of(left) != room) continue;
    for (const std::string& target : reachable(left))
      if (room_of(target) == other) return true;
  }
  return false;
}

std::vector<std::string> wrong_arrows(const fs::path& root, const Arrows& arrows) {
  return Checker(root.lexically_normal(), arrows).run();
}

}  // namespace relign::arrows
