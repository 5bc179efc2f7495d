#include "lens_files/zmx_shape.h"

#include <cmath>

#include "base/text.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {
namespace {

constexpr int kPolynomialTerms = 8;     // PARM 1 to 8 of EVENASPH and ODDASPHE
constexpr int kMaxExtendedTerms = 240;  // of XASPHERE and XOSPHERE

bool is_count(double value, int most) { return value >= 0 && value <= most && value == std::floor(value); }

}  // namespace

void ZmxShape::set_type(int line, const std::string& name) {
  line_ = line;
  type_ = upper_case(name);
}

double ZmxShape::value_of(const Entries& entries, int number) {
  const auto known = entries.find(number);
  return known == entries.end() ? 0 : known->second.value;
}

void ZmxShape::list_unused(Reading& reading, const Surface& surface, const char* word, const Entries& entries,
                           int last) const {
  for (const auto& [number, entry] : entries)
    if ((number > last || number < 1) && entry.value != 0)
      reading.remark(entry.line, std::string("unused ") + word,
                     std::string("not understood: ") + word + " " + std::to_string(number) + " " +
                         shortest(entry.value) + " of surface " + surface.label + ", type " + shown(type_, 20));
}

void ZmxShape::apply(Reading& reading, Surface& surface) const {
  int parameters = 0, extra = 0;  // how many are used
  if (type_ == "COORDBRK") {
    surface.break_only = true;
    parameters = 6;
    apply_break(reading, surface);
  } else if (type_ == "EVENASPH" || type_ == "ODDASPHE") {
    parameters = kPolynomialTerms;
    apply_terms(reading, surface, parameters_, 0, kPolynomialTerms, 1, type_ == "EVENASPH" ? 2 : 1);
  } else if (type_ == "XASPHERE" || type_ == "XOSPHERE") {
    extra = kMaxExtendedTerms + 2;
    apply_extended(reading, surface, type_ == "XASPHERE" ? 2 : 1);
  } else if (type_ == "QED_TYPE") {
    extra = kMaxExtendedTerms + 3;
    apply_q_type(reading, surface);
  } else if (type_ != "STANDARD") {
    reading.problem(line_, "surface " + surface.label + " has unsupported type '" + shown(type_, 20) +
                               "'; supported are STANDARD, EVENASPH, ODDASPHE, XASPHERE, XOSPHERE, QED_TYPE and "
                               "COORDBRK");
    return;
  }
  list_unused(reading, surface, "PARM", parameters_, parameters);
  list_unused(reading, surface, "XDAT", extra_, extra);
}

// 1, 2: decentre x, y; 3, 4, 5: tilt about x, y, z, right-handed; 6: order.
void ZmxShape::apply_break(Reading& reading, Surface& surface) const {
  double tilt_deg[3] = {0, 0, 0};
  for (int i = 0; i < 3; ++i) {
    const auto tilt = parameters_.find(i + 3);
    if (tilt == parameters_.end()) continue;
    if (std::fabs(tilt->second.value) > 360)
      reading.problem(tilt->second.line,
                      "expected a tilt from -360 to 360 degrees, found " + shortest(tilt->second.value));
    else
      tilt_deg[i] = tilt->second.value;
  }
  surface.before = coordinate_break({value_of(parameters_, 1), value_of(parameters_, 2), 0}, tilt_deg[0], tilt_deg[1],
                                    tilt_deg[2], value_of(parameters_, 6) != 0);
}

void ZmxShape::apply_terms(Reading& reading, Surface& surface, const Entries& entries, int before, int terms,
                           double radius, int step) const {
  int unused = 0, unused_line = 0;
  for (const auto& [number, entry] : entries) {
    const int term = number - before, power = term * step;
    if (term < 1 || entry.value == 0) continue;
    if (term > terms) {
      unused_line = unused++ == 0 ? entry.line : unused_line;
    } else if (power == 1) {
      reading.problem(entry.line, "surface " + surface.label + " has a term of r, " + shortest(entry.value) +
                                      " (a cone); supported are terms from r^2 up");
    } else if (power > kHighestPower) {
      reading.problem(entry.line, "surface " + surface.label + " has a term of r^" + std::to_string(power) +
                                      "; supported are terms up to r^" + std::to_string(kHighestPower));
    } else if (const double coefficient = entry.value / std::pow(radius, power); std::isfinite(coefficient)) {
      set_term(surface, power, coefficient);
    } else {
      reading.problem(entry.line, "surface " + surface.label + ": the term of r^" + std::to_string(power) +
                                      " is too large with a normalisation radius of " + shortest(radius));
    }
  }
  if (unused > 0 && before > 0)
    reading.remark(
        unused_line, "terms beyond the stated number",
        "not used: terms beyond the " + std::to_string(terms) + " that XDAT 1 states for surface " + surface.label);
}

// XDAT 1: number of terms, 2: the radius that r is divided by, 3 and up: coefficients in the lens unit.
void ZmxShape::apply_extended(Reading& reading, Surface& surface, int step) const {
  const double stated = value_of(extra_, 1), terms = std::floor(stated), radius = value_of(extra_, 2);
  const int line = extra_.count(1) > 0 ? extra_.at(1).line : line_;
  if (!is_count(terms, kMaxExtendedTerms)) {
    reading.problem(line, "surface " + surface.label + ": XDAT 1: expected a number of terms from 0 to " +
                              std::to_string(kMaxExtendedTerms) + ", found " + shortest(stated));
    return;
  }
  if (terms != stated)  // occurs in files of design programs
    reading.remark(line, "count of terms",
                   "surface " + surface.label + ": XDAT 1 states " + shortest(stated) +
                       (stated == 1 ? " term; " : " terms; ") + std::to_string(static_cast<int>(terms)) +
                       (terms == 1 ? " is read" : " are read"));
  if (terms >= 1 && !(radius > 0)) {
    reading.problem(line, "surface " + surface.label + ": XDAT 2: expected a normalisation radius above 0, found " +
                              shortest(radius));
    return;
  }
  apply_terms(reading, surface, extra_, 2, static_cast<int>(terms), radius, step);
}

// XDAT 1: 0 for Q_bfs, 1 for Q_con; 2: number of terms; 3: normalisation radius; 4 and up: coefficients.
void ZmxShape::apply_q_type(Reading& reading, Surface& surface) const {
  const double kind = value_of(extra_, 1), terms = value_of(extra_, 2);
  QAsphere asphere;
  asphere.radius_mm = value_of(extra_, 3);
  if (kind != 0 && kind != 1) {
    reading.problem(line_, "surface " + surface.label + ": XDAT 1: unsupported Q-type '" + shortest(kind) +
                               "'; supported are 0 (Q_bfs) and 1 (Q_con)");
    return;
  }
  if (!is_count(terms, kMaxQTerms)) {
    reading.problem(extra_.at(2).line, "surface " + surface.label +
                                           ": XDAT 2: expected an integer number of terms from 0 to " +
                                           std::to_string(kMaxQTerms) + ", found " + shortest(terms));
    return;
  }
  for (int i = 0; i < static_cast<int>(terms); ++i) asphere.coefficients.push_back(value_of(extra_, i + 4));
  while (!asphere.coefficients.empty() && asphere.coefficients.back() == 0) asphere.coefficients.pop_back();
  if (asphere.coefficients.empty()) return;
  if (!(asphere.radius_mm > 0)) {
    reading.problem(line_, "surface " + surface.label + ": XDAT 3: expected a normalisation radius above 0, found " +
                               shortest(asphere.radius_mm));
    return;
  }
  if (kind == 1) reading.remark(line_, "Q-type 1", "surface " + surface.label + ": Q-type 1 is read as Q_con");
  (kind == 0 ? surface.q_bfs : surface.q_con) = asphere;
}

}  // namespace relign::lens_files
