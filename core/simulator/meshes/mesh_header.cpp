#include "meshes/mesh_header.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/text.h"

namespace relign::meshes {
namespace {

[[noreturn]] void reject_header(const std::string& file, const std::string& message) {
  throw Error(ErrorKind::bad_input, file + ": " + message);
}

std::uint64_t bytes_of(const std::string& type) {
  static const std::map<std::string, std::uint64_t> kBytes = {
      {"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1}, {"short", 2},  {"ushort", 2},
      {"int16", 2}, {"uint16", 2},  {"int", 4},    {"uint", 4},  {"int32", 4},  {"uint32", 4},
      {"float", 4}, {"float32", 4}, {"double", 8}, {"int64", 8}, {"uint64", 8}, {"float64", 8}};
  const auto found = kBytes.find(type);
  return found == kBytes.end() ? 0 : found->second;
}

constexpr std::uint64_t kMinCorners = 3;
constexpr std::size_t kLongestShown = 60;

// One element of the header: "element face 20" and the properties under it.
struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::uint64_t least_bytes = 0;  // of one entry, in binary files
  std::vector<bool> lists = {};   // of its properties, which are lists
};

// Removes and returns the text before any of the characters `end` (all of it if there is none).
std::string_view take_until(std::string_view& rest, const char* end) {
  const std::size_t length = std::min(rest.find_first_of(end), rest.size());
  const std::string_view taken = rest.substr(0, length);
  rest.remove_prefix(std::min(length + 1, rest.size()));
  return taken;
}

// Empty at the end of the line.
std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
  return take_until(line, " \t\r");
}

// Whether assimp reads the same number: digits only, and not too many.
bool is_count(std::string_view word) {
  constexpr std::size_t kMaxDigits = 10;
  return !word.empty() && word.size() <= kMaxDigits && word.find_first_not_of("0123456789") == std::string_view::npos;
}

// Text files: one line per entry, with as many values as the header states. On other lines assimp loses its position,
// and allocates memory for whatever number it then takes for the length of a list.
void check_lines(const std::string& file, const std::vector<PlyElement>& elements, std::string_view body) {
  for (const PlyElement& element : elements)
    for (std::uint64_t entry = 0; entry < element.count && !body.empty(); ++entry) {
      std::string_view line = take_until(body, "\n");
      const std::string shown = std::string(line.substr(0, kLongestShown));
      const auto refuse_line = [&](const char* what) {
        reject_header(file, std::string(what) + " in entry " + std::to_string(entry) + " of element '" + element.name +
                                "': '" + shown + "'");
      };
      for (const bool list : element.lists) {
        const std::string_view word = take_word(line);
        if (word.empty()) refuse_line("fewer values than the header states");
        if (!list) continue;
        if (!is_count(word)) refuse_line("expected the number of values of a list");
        unsigned long values = std::strtoul(std::string(word).c_str(), nullptr, 10);
        while (values > 0 && !take_word(line).empty()) --values;
        if (values > 0) refuse_line("fewer values than the list states");
      }
      if (!take_word(line).empty()) refuse_line("more values than the header states");
    }
}

// Position of the line "end_header". assimp searches for the line and never returns if there is only the word.
std::size_t end_of_header(const std::string& content) {
  const std::string line = "\nend_header";
  const std::size_t found = content.find(line);
  if (found == std::string::npos) return found;
  const std::size_t behind = content.find_first_not_of(" \t\r", found + line.size());
  return behind != std::string::npos && content[behind] == '\n' ? found + 1 : std::string::npos;
}

bool is_header_word(const std::string& word) {
  for (const char* known : {"", "ply", "format", "comment", "obj_info", "element", "property"})
    if (word == known) return true;
  return false;
}

}  // namespace

HeaderCounts check_ply_header(const std::string& file, const std::string& content) {
  if (content.compare(0, 3, "ply") != 0) reject_header(file, "not a PLY file: it does not begin with 'ply'");
  const std::size_t end = end_of_header(content);
  const std::size_t body = end == std::string::npos ? end : content.find('\n', end);
  if (body == std::string::npos) reject_header(file, "the file is truncated: its header has no line 'end_header'");
  std::istringstream header(content.substr(0, end));
  std::vector<PlyElement> elements;
  bool text = false;
  for (std::string line; std::getline(header, line);) {
    std::istringstream words(line);
    std::string word, first, second, third;
    words >> word >> first >> second >> third;
    const auto shown = [&] { return "'" + line.substr(0, kLongestShown) + "'"; };
    if (word == "format") {
      text = first == "ascii";
      if (!text && first != "binary_little_endian" && first != "binary_big_endian")
        reject_header(file, "unknown format " + shown() +
                                " in the header; allowed: ascii, binary_little_endian, binary_big_endian");
    }
    if (word == "element") {
      if (!is_count(second)) reject_header(file, "expected a number of entries in the header, found " + shown());
      elements.push_back({first, std::strtoull(second.c_str(), nullptr, 10), 0});
    }
    if (word == "property" && !elements.empty()) {
      const bool list = first == "list", corners = list && elements.back().name == "face";
      if (bytes_of(list ? second : first) == 0 || (list && bytes_of(third) == 0))
        reject_header(file, "unknown type of a property of element '" + elements.back().name + "': '" + line + "'");
      elements.back().lists.push_back(list);
      elements.back().least_bytes +=
          list ? bytes_of(second) + (corners ? kMinCorners * bytes_of(third) : 0) : bytes_of(first);
    } else if (!is_header_word(word)) {
      reject_header(file, "unknown line in the header: " + shown());
    }
  }
  for (const PlyElement& element : elements)
    if (element.least_bytes == 0 && element.count > 0)
      reject_header(file, "element '" + element.name + "' has no properties");
  const auto count_of = [&](const std::string& name) -> std::optional<std::uint64_t> {
    for (const PlyElement& element : elements)
      if (element.name == name) return element.count;
    return std::nullopt;
  };
  const std::optional<std::uint64_t> vertices = count_of("vertex"), faces = count_of("face");
  if (!vertices || !faces) reject_header(file, "expected a mesh, but the header lists no vertices or no faces");
  // Text files: one line per entry. In double, so that no count overflows.
  double least = 0;
  for (const PlyElement& element : elements)
    least += static_cast<double>(element.count) * (text ? 1.0 : static_cast<double>(element.least_bytes));
  const auto found = text ? std::count(content.begin() + static_cast<std::ptrdiff_t>(body), content.end(), '\n') +
                                (content.back() == '\n' ? -1 : 0)
                          : static_cast<std::ptrdiff_t>(content.size() - body - 1);
  if (static_cast<double>(found) < least)
    reject_header(file, "the file is truncated: its header states " + std::to_string(*vertices) +
                            (*vertices == 1 ? " vertex and " : " vertices and ") + counted(*faces, "face") +
                            ", but only " + counted(static_cast<std::uint64_t>(found), text ? "line" : "byte") +
                            (found == 1 ? " follows" : " follow"));
  if (text) check_lines(file, elements, std::string_view(content).substr(body + 1));
  return {faces};
}

HeaderCounts check_stl_header(const std::string& file, const std::string& content) {
  constexpr std::size_t kHeader = 84, kFace = 50;
  const bool text = content.compare(0, 5, "solid") == 0;
  if (content.size() >= kHeader) {
    std::uint32_t faces = 0;
    std::memcpy(&faces, content.data() + kHeader - sizeof faces, sizeof faces);
    const std::uint64_t size = kHeader + kFace * static_cast<std::uint64_t>(faces);
    if (size == content.size()) return {faces};
    if (!text)
      reject_header(file, "the file is truncated or not an STL: its header states " + counted(faces, "face") + " (" +
                              std::to_string(size) + " bytes), found " + counted(content.size(), "byte"));
  }
  if (!text)
    reject_header(file, "not an STL file: found " + counted(content.size(), "byte") + ", shorter than a header");
  if (content.find("endsolid") == std::string::npos)
    reject_header(file, "the file is truncated: the text STL has no 'endsolid'");
  return {};
}

}  // namespace relign::meshes
