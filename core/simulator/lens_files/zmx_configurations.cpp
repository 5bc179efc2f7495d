#include "lens_files/zmx_configurations.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace relign::lens_files {
namespace {

constexpr std::size_t kMaxOperands = 1000;

// One row: operand, surface or field or wavelength, configuration, value.
struct Operand {
  int line = 0;
  std::string value;
};

int whole_number(const std::string& word) {
  constexpr double kMost = 1e6;
  const double value = parse_number(word).value_or(-1);
  return value == std::floor(value) && std::fabs(value) <= kMost ? static_cast<int>(value) : -1;
}

class Configurations {
 public:
  Configurations(std::vector<TextLine>& lines, Reading& reading) : lines_(lines), reading_(reading) {}

  void choose(int wanted) {
    read();
    if (wanted == 0) {
      if (count_ > 1)
        reading_.remark(line_, "configurations",
                        "not used: further configurations; the lens is read in the current one, configuration " +
                            std::to_string(active_) + " of " + std::to_string(count_) +
                            " (--configuration selects another)");
      return;
    }
    if (wanted > count_) {
      reading_.problem(line_,
                       "unknown configuration " + std::to_string(wanted) + "; the file has " + std::to_string(count_));
      return;
    }
    if (operands_.size() > kMaxOperands) {
      reading_.problem(line_, "found " + std::to_string(operands_.size()) +
                                  " operands of configurations; allowed are " + std::to_string(kMaxOperands));
      return;
    }
    for (const auto& [key, rows] : operands_) {
      const auto row = rows.find(wanted), now = rows.find(active_);
      if (row == rows.end() || (now != rows.end() && now->second.value == row->second.value)) continue;
      apply(key.first, key.second, row->second, wanted);
    }
  }

 private:
  void read() {
    bool inside = false;
    for (const TextLine& line : lines_) {
      const std::vector<std::string> words = words_of(line.text);
      if (words.size() > 1 && upper_case(words[0]) == "MNUM") {
        inside = true;
        line_ = line.number;
        count_ = std::max(1, whole_number(words[1]));
        active_ = words.size() > 2 ? std::max(1, whole_number(words[2])) : 1;
      } else if (inside && words.size() > 3 && words[0].size() == 4) {
        const int number = whole_number(words[1]), configuration = whole_number(words[2]);
        if (number >= 0 && configuration >= 1 && configuration <= count_)
          operands_[{upper_case(words[0]), number}][configuration] = {line.number, words[3]};
      }
    }
  }

  void apply(const std::string& name, int number, const Operand& row, int wanted) {
    static const std::set<std::string> kIgnoredWords = {"LTTL", "MOFF", "MCOM", "CWGT", "FLWT", "WLWT"};
    static const std::map<std::string, std::string> kOfSurface = {
        {"THIC", "DISZ"}, {"CRVT", "CURV"}, {"CONN", "CONI"}, {"SDIA", "DIAM"}};
    static const std::map<std::string, std::string> kOfList = {{"YFIE", "YFLN"}, {"XFIE", "XFLN"}, {"FVCY", "VCYN"},
                                                               {"FVDY", "VDYN"}, {"FVCX", "VCXN"}, {"FVDX", "VDXN"},
                                                               {"FVAN", "VANN"}};
    bool applied = kIgnoredWords.count(name) > 0;
    if (const auto word = kOfSurface.find(name); word != kOfSurface.end())
      applied = set_in_surface(number, word->second, "  " + word->second + " " + row.value, row.line);
    if (const auto word = kOfList.find(name); word != kOfList.end())
      applied = set_word({word->second}, static_cast<std::size_t>(number), row.value, row.line);
    if (name == "GLSS" && row.value.find("BLANK") == std::string::npos)
      applied =
          set_in_surface(number, "GLAS", row.value.empty() ? "" : "  GLAS " + row.value + " 0 0 1.5 40", row.line);
    if (name == "APER") applied = set_word({"ENPD", "FNUM", "OBNA"}, 1, row.value, row.line);
    if (name == "PRWV") applied = set_word({"PWAV"}, 1, row.value, row.line);
    if (name == "WAVE") applied = set_wavelength(number, row);
    if (!applied)
      reading_.problem(row.line, "operand " + shown(name, 20) + " " + std::to_string(number) +
                                     " differs between configuration " + std::to_string(wanted) + " and " +
                                     std::to_string(active_) + ", the current one; it is not supported");
  }

  // Replaces the line, or inserts it after SURF.
  bool set_in_surface(int surface, const std::string& keyword, const std::string& text, int number) {
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      const std::vector<std::string> words = words_of(lines_[i].text);
      if (words.size() < 2 || upper_case(words[0]) != "SURF" || whole_number(words[1]) != surface) continue;
      for (std::size_t j = i + 1; j < lines_.size(); ++j) {
        const std::vector<std::string> own = words_of(lines_[j].text);
        const std::string first = own.empty() ? "" : upper_case(own[0]);
        if (first == "SURF" || first == "MNUM") break;
        if (first != keyword) continue;
        lines_[j] = {number, text};
        return true;
      }
      lines_.insert(lines_.begin() + static_cast<std::ptrdiff_t>(i) + 1, {number, text});
      return true;
    }
    return false;
  }

  // Word `place` of the first line with one of the keywords.
  bool set_word(const std::set<std::string>& keywords, std::size_t place, const std::string& value, int number) {
    for (TextLine& line : lines_) {
      std::vector<std::string> words = words_of(line.text);
      if (words.empty() || keywords.count(upper_case(words[0])) == 0) continue;
      if (place < 1 || place >= words.size()) return false;
      words[place] = value;
      line = {number, ""};
      for (const std::string& word : words) line.text += (line.text.empty() ? "" : " ") + word;
      return true;
    }
    return false;
  }

  bool set_wavelength(int wavelength, const Operand& row) {
    for (TextLine& line : lines_) {
      const std::vector<std::string> words = words_of(line.text);
      if (words.size() < 3 || upper_case(words[0]) != "WAVM" || whole_number(words[1]) != wavelength) continue;
      line = {row.line,
              "WAVM " + std::to_string(wavelength) + " " + row.value + " " + (words.size() > 3 ? words[3] : "1")};
      return true;
    }
    return false;
  }

  std::vector<TextLine>& lines_;
  Reading& reading_;
  int line_ = 0, count_ = 1, active_ = 1;
  std::map<std::pair<std::string, int>, std::map<int, Operand>> operands_;  // by configuration
};

}  // namespace

void choose_configuration(std::vector<TextLine>& lines, Reading& reading, int wanted) {
  Configurations(lines, reading).choose(wanted);
}

}  // namespace relign::lens_files
