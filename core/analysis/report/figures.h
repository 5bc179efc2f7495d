// Every static figure of a report, from page_data: the page shows some of them, `report --figures` writes them all.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "report/svg_chart.h"

namespace relign::report {

struct Figure {
  std::string name;     // of its files, without ending; letters, digits, '-', '.'
  std::string caption;  // what it shows, and what its bands and bars are
  Chart chart;
};

// The same colour and dash for one method in all charts, the drawn curves' as well: by the methods' order, without
// those that have no curve. Oracles share one of their own.
std::map<std::string, int> method_styles(const Json& data);  // by style_key
inline std::string style_key(const std::string& method, const std::string& protocol) {
  return method + "\n" + protocol;
}

inline constexpr std::size_t kMostMethodsInFigure = 40;  // of a group, the best

// One group's; none where their numbers are absent. `index` is the group's place.
std::vector<Figure> curve_figures(const Json& data, std::size_t index);
std::vector<Figure> ecdf_figures(const Json& data, std::size_t index, std::size_t most = kMostMethodsInFigure);
// One for each unit.
std::vector<Figure> residual_figures(const Json& data, std::size_t index, std::size_t most = kMostMethodsInFigure);

// Performance profile and error by images, of one entry of "aggregate"; `index` is its place (aggregate_figures.cpp).
std::vector<Figure> aggregate_figures(const Json& data, std::size_t index, std::size_t most = kMostMethodsInFigure);

// Yield and images to spec over the noise levels of each scene and protocol.
std::vector<Figure> level_figures(const Json& data);

// The error of the perfect lens along each axis, of one entry of "scene_facts"; `index` is its place.
std::optional<Figure> landscape_figure(const Json& facts, std::size_t index);

// A name for a file: of anybody's text only letters, digits, '-', '.', '_'.
std::string figure_file_name(const std::string& text);

std::vector<Figure> all_figures(const Json& data);

// Each as NAME.svg and NAME.csv; makes the folder. Returns the files' paths. Throws Error(io).
std::vector<std::filesystem::path> write_figures(const Json& data, const std::filesystem::path& folder);

}  // namespace relign::report
