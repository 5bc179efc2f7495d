// Glasses: refractive indices from dispersion formulas, as AGF catalogues number them.
//
// Indices are relative to air at standard conditions, as catalogues give them. Built in are the glasses of the shipped
// lenses and of the vendors' catalogues (glass_catalogue.h); lens files define any other by its coefficients.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"

namespace relign::optics {

struct Glass {
  std::string name;
  int agf_formula = 0;  // 1 to kAgfFormulas, or kNdVd: coefficients are nd and Vd
  std::vector<double> coefficients;
};

inline constexpr int kNdVd = 0;
// 1 Schott, 2 Sellmeier 1, 3 Herzberger, 4 Sellmeier 2, 5 Conrady, 6 Sellmeier 3, 7 and 8 Handbook of Optics 1
// and 2, 9 Sellmeier 4, 10 Extended 1, 11 Sellmeier 5, 12 Extended 2, 13 Extended 3.
inline constexpr int kAgfFormulas = 13;

// Number of coefficients of a formula; missing ones are 0.
std::size_t coefficient_count(int agf_formula);

// Throws Error(bad_input) where the formula gives no index from 1 to 5. A glass given by nd and Vd alone follows
// Cauchy's formula n = A + B / wavelength^2 through both, accurate to about 1e-4 between the F and C lines.
double refractive_index(const Glass& glass, double wavelength_nm);

// Null when there is no built-in glass of that name.
const Glass* find_glass(const std::string& name);
// Finds a built-in glass by a variant of its name: with the vendor behind "_" or "-", in lower case, or without hyphens
// and blanks (NBK7, "n-bk7 schott", SF5_SCHOTT). Null if there is none, or none of that vendor.
const Glass* find_glass_like(const std::string& name);
std::vector<std::string> glass_names();

// Fictitious glasses, nd and Vd in digits: 517642 is nd 1.517, Vd 64.2; 487490.704058 is nd 1.487490, Vd 70.4058.
std::optional<Glass> glass_of_code(const std::string& code);

// {"agf_formula": 2, "coefficients": [...]} or {"nd": 1.5, "vd": 60}, whose members the schema of lenses has checked;
// `pointer`: its place in `source`. Appends mistakes to `problems`.
std::optional<Glass> glass_of(const Json& file, const JsonSource& source, const std::string& pointer,
                              const std::string& name, std::vector<Problem>& problems);

}  // namespace relign::optics
