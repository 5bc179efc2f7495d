#include "lens_files/agf_reader.h"

#include "lens_files/lens_design.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {

std::vector<CatalogueGlass> read_agf(std::string_view bytes, const std::string& file) {
  constexpr std::size_t kMaxGlasses = 20000;
  constexpr int kMaxFormula = 13;
  Reading reading(file, "AGF");
  std::vector<CatalogueGlass> glasses;
  for (const TextLine& line : text_lines(bytes, file)) {
    const std::vector<std::string> words = words_of(line.text);
    if (words.empty()) continue;
    const std::string keyword = upper_case(words[0]);
    const auto number = [&](std::size_t i, const char* what) {
      return reading.number(line.number, i < words.size() ? words[i] : "", what);
    };
    if (keyword == "NM") {
      if (glasses.size() == kMaxGlasses) {
        reading.problem(line.number, "more than " + std::to_string(kMaxGlasses) + " glasses");
        break;
      }
      CatalogueGlass glass;
      glass.line = line.number;
      glass.name = words.size() > 1 ? words[1] : "";
      if (glass.name.empty()) reading.problem(line.number, "NM: missing name of the glass");
      glass.formula = reading.integer(line.number, words.size() > 2 ? words[2] : "", "NM, formula");
      if (glass.formula < 1 || glass.formula > kMaxFormula)
        reading.problem(line.number, "NM: expected a formula from 1 to 13, found " + std::to_string(glass.formula));
      glass.nd = words.size() > 4 ? number(4, "NM, nd") : 0;
      glass.vd = words.size() > 5 ? number(5, "NM, Vd") : 0;
      glasses.push_back(glass);
    } else if (keyword == "CD" && !glasses.empty()) {
      glasses.back().coefficients.clear();
      for (std::size_t i = 1; i < words.size(); ++i) glasses.back().coefficients.push_back(number(i, "CD"));
    } else if (keyword == "LD" && !glasses.empty() && words.size() > 2) {
      glasses.back().low_um = number(1, "LD");
      glasses.back().high_um = number(2, "LD");
    }
  }
  if (glasses.empty()) reading.problem(0, "no glass (NM) found; check that this is a complete glass catalogue (AGF)");
  for (const CatalogueGlass& glass : glasses)
    if (glass.coefficients.empty())
      reading.problem(glass.line, "glass '" + shown(glass.name, 40) +
                                      "' has no coefficients (CD); check that the file is complete");
  throw_if_any(reading.finish().problems);
  return glasses;
}

}  // namespace relign::lens_files
