// The static figures of a report, from the model: the page shows some of them, `report --figures` writes all.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "report/page_model.h"
#include "report/svg_chart.h"

namespace relign::report {

struct Figure {
  std::string name;     // of its files, without extension; letters, digits, '-', '.', '_'
  std::string caption;  // including the meaning of bands and bars
  Chart chart;
};

// Styles (colour and dash) by style_key, the same for a method in all charts: numbered in the order of the methods with
// curves. Oracles share one style.
std::map<std::string, int> method_styles(const PageModel& page);
inline std::string style_key(const std::string& method, const std::string& protocol) {
  return method + "\n" + protocol;
}

inline constexpr std::size_t kMaxMethodsInFigure = 40;  // of a group, the best ones

// Of one group, `index` into its groups; empty without data.
std::vector<Figure> curve_figures(const PageModel& page, std::size_t index);
std::vector<Figure> ecdf_figures(const PageModel& page, std::size_t index, std::size_t most = kMaxMethodsInFigure);
// One per unit.
std::vector<Figure> residual_figures(const PageModel& page, std::size_t index, std::size_t most = kMaxMethodsInFigure);

// Performance profile and convergence of one aggregate, by its index (aggregate_figures.cpp).
std::vector<Figure> aggregate_figures(const PageModel& page, std::size_t index, std::size_t most = kMaxMethodsInFigure);

// Yield and moves to specification over the noise levels, per scene and protocol.
std::vector<Figure> level_figures(const PageModel& page);

// Error of the nominal lens along each axis, of one scene, by its index.
std::optional<Figure> landscape_figure(const SceneFacts& facts, std::size_t index);

// A file name from any text: other characters than letters, digits, '.', '_' become '-'.
std::string figure_file_name(const std::string& text);

std::vector<Figure> all_figures(const PageModel& page);

// Writes each as NAME.svg and NAME.csv; creates the folder. Returns the paths. Throws Error (io).
std::vector<std::filesystem::path> write_figures(const PageModel& page, const std::filesystem::path& folder);

}  // namespace relign::report
