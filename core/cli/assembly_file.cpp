#include "cli/assembly_file.h"

#include <algorithm>
#include <limits>

#include "base/json_source.h"
#include "base/text.h"

namespace relign::cli {

std::string read_assembly(const std::filesystem::path& file, const std::vector<std::string>& elements,
                          const std::vector<std::string>& quantities) {
  std::vector<std::string> names = elements;
  names.insert(names.end(), quantities.begin(), quantities.end());
  const JsonSource source = JsonSource::from_file(file);
  std::vector<Problem> problems;
  ObjectReader reader(source, "", problems);
  const Json* given = reader.get("elements");
  reader.reject_unknown();
  if (given == nullptr) {
    reader.complain_missing("elements", "such as {\"L2\": {\"tilt_deg\": [rx, ry], \"shift_mm\": [x, y, z]}}");
  } else if (!given->is_object()) {
    problems.push_back(source.problem(
        "/elements", std::string("expected an object of elements by name, found ") + given->type_name()));
  } else {
    for (const auto& [name, offsets] : given->items()) {
      const std::string pointer = "/elements/" + name;
      if (std::find(names.begin(), names.end(), name) == names.end())
        problems.push_back(source.problem(pointer, "unknown element '" + name + "'" + suggestion(name, names)));
      ObjectReader offset_reader(source, pointer, problems);
      if (std::find(quantities.begin(), quantities.end(), name) != quantities.end()) {
        constexpr double kMost = std::numeric_limits<double>::max();
        offset_reader.required_number("value", -kMost, kMost);
      } else {
        offset_reader.numbers("shift_mm", 3, {0, 0, 0});
        offset_reader.numbers("tilt_deg", 2, {0, 0});
      }
      offset_reader.reject_unknown();
    }
  }
  throw_if_any(problems);
  return given->dump();
}

}  // namespace relign::cli
