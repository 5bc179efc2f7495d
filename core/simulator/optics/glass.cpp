#include "optics/glass.h"

#include <cctype>
#include <charconv>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "optics/glass_catalogue.h"

namespace relign::optics {
namespace {

// Schott's catalogue of 2017-01-20, Sellmeier 1: B1 C1 B2 C2 B3 C3. SK16 is Hikari's, 2017: Schott replaced it by
// N-SK16, and the published values of the Cooke triplet use Hikari's.
const std::vector<Glass>& built_in() {
  static const std::vector<Glass> glasses = {
      {"F2", 2, {1.34533359, 0.00997743871, 0.209073176, 0.0470450767, 0.937357162, 111.886764}},
      {"K10", 2, {1.15687082, 0.00809424251, 0.0642625444, 0.0386051284, 0.872376139, 104.74773}},
      {"LF5", 2, {1.28035628, 0.00929854416, 0.163505973, 0.0449135769, 0.893930112, 110.493685}},
      {"N-BAF10", 2, {1.5851495, 0.00926681282, 0.143559385, 0.0424489805, 1.08521269, 105.613573}},
      {"N-BK7", 2, {1.03961212, 0.00600069867, 0.231792344, 0.0200179144, 1.01046945, 103.560653}},
      {"N-F2", 2, {1.39757037, 0.00995906143, 0.159201403, 0.0546931752, 1.2686543, 119.248346}},
      {"N-LAK12", 2, {1.17365704, 0.00577031797, 0.588992398, 0.0200401678, 0.978014394, 95.4873482}},
      {"N-LAK34", 2, {1.26661442, 0.00589278062, 0.665919318, 0.0197509041, 1.1249612, 78.8894174}},
      {"N-LASF44", 2, {1.78897105, 0.00872506277, 0.38675867, 0.0308085023, 1.30506243, 92.743824}},
      {"N-SF11", 2, {1.73759695, 0.013188707, 0.313747346, 0.0623068142, 1.89878101, 155.23629}},
      {"N-SK15", 2, {1.30417786, 0.00695051276, 0.28584116, 0.0232023703, 0.974781572, 99.016884}},
      {"N-SK16", 2, {1.34317774, 0.00704687339, 0.241144399, 0.0229005, 0.994317969, 92.7508526}},
      {"SF4", 2, {1.61957826, 0.0125502104, 0.339493189, 0.0544559822, 1.02566931, 117.652222}},
      {"SK16", 1, {2.592001, -0.01540969, 0.0102268, 0.001581559, -0.0001877149, 1.012515e-05}},
  };
  return glasses;
}

// Spectral lines d, F, C in micrometres.
constexpr double kLineD = 0.5875618, kLineF = 0.4861327, kLineC = 0.6562725;

// Coefficients k and l of terms k w2 / (w2 - l), from `first` on.
double sellmeier_terms(const std::vector<double>& c, std::size_t first, std::size_t terms, double w2) {
  double sum = 0;
  for (std::size_t i = first; i < first + 2 * terms; i += 2) sum += c[i] * w2 / (w2 - c[i + 1]);
  return sum;
}

double cauchy(double nd, double vd, double w) {
  const double b = (nd - 1) / vd / (1 / (kLineF * kLineF) - 1 / (kLineC * kLineC));
  return nd + b * (1 / (w * w) - 1 / (kLineD * kLineD));
}

// w in micrometres; NaN where a formula is undefined.
double index_at(int formula, const std::vector<double>& c, double w) {
  const double w2 = w * w, w4 = w2 * w2;
  const double p2 = 1 / w2, p4 = p2 * p2;
  switch (formula) {
    case kNdVd:
      return cauchy(c[0], c[1], w);
    case 1:
      return std::sqrt(c[0] + c[1] * w2 + c[2] * p2 + c[3] * p4 + c[4] * p4 * p2 + c[5] * p4 * p4);
    case 2:
      return std::sqrt(1 + sellmeier_terms(c, 0, 3, w2));
    case 3: {
      const double l = 1 / (w2 - 0.028);
      return c[0] + c[1] * l + c[2] * l * l + c[3] * w2 + c[4] * w4 + c[5] * w4 * w2;
    }
    case 4:
      return std::sqrt(1 + c[0] + c[1] * w2 / (w2 - c[2]) + c[3] * w2 / (w2 - c[4]));
    case 5:
      return c[0] + c[1] / w + c[2] * p2 / (w * std::sqrt(w));
    case 6:
      return std::sqrt(1 + sellmeier_terms(c, 0, 4, w2));
    case 7:
      return std::sqrt(c[0] + c[1] / (w2 - c[2]) - c[3] * w2);
    case 8:
      return std::sqrt(c[0] + c[1] * w2 / (w2 - c[2]) - c[3] * w2);
    case 9:
      return std::sqrt(c[0] + c[1] * w2 / (w2 - c[2]) + c[3] * w2 / (w2 - c[4]));
    case 10:
      return std::sqrt(c[0] + c[1] * w2 + c[2] * p2 + c[3] * p4 + c[4] * p4 * p2 + c[5] * p4 * p4 +
                       c[6] * p4 * p4 * p2 + c[7] * p4 * p4 * p4);
    case 11:
      return std::sqrt(1 + sellmeier_terms(c, 0, 5, w2));
    case 12:
      return std::sqrt(c[0] + c[1] * w2 + c[2] * p2 + c[3] * p4 + c[4] * p4 * p2 + c[5] * p4 * p4 + c[6] * w4 +
                       c[7] * w4 * w2);
    case 13:
      return std::sqrt(c[0] + c[1] * w2 + c[2] * w4 + c[3] * p2 + c[4] * p4 + c[5] * p4 * p2 + c[6] * p4 * p4 +
                       c[7] * p4 * p4 * p2 + c[8] * p4 * p4 * p4);
    default:
      return std::nan("");
  }
}

bool digits_only(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

// Letters and digits alone, in upper case: programs write N-BK7 as NBK7 or n-bk7.
std::string letters_of(const std::string& name) {
  std::string letters;
  for (const char letter : name)
    if (std::isalnum(static_cast<unsigned char>(letter)))
      letters += static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
  return letters;
}

// Of digits and a point; independent of the locale.
double number(const std::string& text) {
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

}  // namespace

std::size_t coefficient_count(int agf_formula) {
  constexpr std::size_t counts[kAgfFormulas + 1] = {2, 6, 6, 6, 5, 3, 8, 4, 4, 5, 8, 10, 8, 9};
  return counts[agf_formula];
}

double refractive_index(const Glass& glass, double wavelength_nm) {
  std::vector<double> coefficients = glass.coefficients;
  coefficients.resize(coefficient_count(glass.agf_formula), 0.0);
  const double index = index_at(glass.agf_formula, coefficients, wavelength_nm / 1000);
  if (!(index >= 1 && index <= 5))
    throw Error(ErrorKind::bad_input, "the glass '" + glass.name + "' has no refractive index from 1 to 5 at " +
                                          shortest(wavelength_nm) + " nm" +
                                          (std::isnan(index) ? "" : " (its formula gives " + shortest(index) + ")") +
                                          "; check formula, coefficients and wavelength (formulas take micrometres)");
  return index;
}

const Glass* find_glass(const std::string& name) {
  for (const Glass& glass : built_in())
    if (glass.name == name) return &glass;
  for (const PublishedGlass& published : published_glasses())
    if (published.glass.name == name) return &published.glass;
  return nullptr;
}

const Glass* find_glass_like(const std::string& name) {
  std::string stem = name, vendor;
  if (const std::size_t at = name.find_last_of("_- "); at != std::string::npos && at > 0) {
    for (const char letter : name.substr(at + 1))
      vendor += static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
    if (is_glass_vendor(vendor))
      stem.resize(at);
    else
      vendor.clear();
  }
  const std::string wanted = letters_of(stem);
  const Glass* found = nullptr;
  for (const PublishedGlass& published : published_glasses()) {
    if (!vendor.empty() && published.vendor != vendor) continue;
    const std::string letters = letters_of(published.glass.name);
    if (letters == wanted || letters == wanted + vendor) {
      found = &published.glass;
      break;
    }
  }
  // The glasses of the shipped lenses have Schott's names, whatever their vendor, and keep their own coefficients.
  for (const Glass& glass : built_in())
    if (letters_of(glass.name) == wanted &&
        (vendor.empty() || vendor == "SCHOTT" || (found && found->name == glass.name)))
      return &glass;
  return found;
}

std::vector<std::string> glass_names() {
  std::vector<std::string> names;
  for (const Glass& glass : built_in()) names.push_back(glass.name);
  for (const PublishedGlass& published : published_glasses())
    if (find_glass(published.glass.name) == &published.glass) names.push_back(published.glass.name);
  return names;
}

std::optional<Glass> glass_of_code(const std::string& code) {
  const auto dot = code.find('.');
  std::string index = code.substr(0, dot);
  std::string abbe;
  if (dot == std::string::npos) {
    if (index.size() != 6) return std::nullopt;
    abbe = index.substr(3);
    index.resize(3);
  } else {
    abbe = code.substr(dot + 1);
  }
  if (!digits_only(index) || !digits_only(abbe) || index.size() < 3 || abbe.size() < 3) return std::nullopt;
  if (index.size() > 9 || abbe.size() > 9) return std::nullopt;
  const double nd = number("1." + index);
  const double vd = number(abbe.substr(0, 2) + "." + abbe.substr(2));
  if (!(nd > 1 && vd > 0)) return std::nullopt;
  return Glass{code, kNdVd, {nd, vd}};
}

std::optional<Glass> glass_of(const Json& file, const JsonSource& source, const std::string& pointer,
                              const std::string& name, std::vector<Problem>& problems) {
  const std::size_t before = problems.size();
  const auto complain = [&](const std::string& key, const std::string& message) {
    problems.push_back(source.problem(pointer + key, message));
  };
  const auto has = [&file](const char* key) { return file.contains(key); };
  Glass glass;
  glass.name = name;
  if (has("nd") || has("vd")) {
    for (const char* key : {"nd", "vd"})
      if (!has(key)) complain("", std::string("missing key '") + key + "' (number)");
    if (has("agf_formula") || has("coefficients"))
      complain("", "give either 'nd' and 'vd' or 'agf_formula' and 'coefficients'");
    glass.coefficients = {file.value("nd", 0.0), file.value("vd", 0.0)};
  } else if (!has("agf_formula") || !has("coefficients")) {
    complain("", "the keys 'agf_formula' and 'coefficients', or 'nd' and 'vd', are missing");
  } else {
    glass.agf_formula = file["agf_formula"];
    glass.coefficients = file["coefficients"].get<std::vector<double>>();
    const std::size_t most = coefficient_count(glass.agf_formula);
    // Catalogues list ten coefficients, however many the formula has.
    while (glass.coefficients.size() > most && glass.coefficients.back() == 0) glass.coefficients.pop_back();
    if (glass.coefficients.empty() || glass.coefficients.size() > most)
      complain("/coefficients", "formula " + std::to_string(glass.agf_formula) + " takes 1 to " + std::to_string(most) +
                                    " coefficients, found " + std::to_string(glass.coefficients.size()));
  }
  if (problems.size() > before) return std::nullopt;
  return glass;
}

}  // namespace relign::optics
