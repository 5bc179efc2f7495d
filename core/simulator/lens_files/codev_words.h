// Words that CODE V's sequence files (.seq) and listings share: system data, glass names, clear apertures.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

class CodeVSystem {
 public:
  explicit CodeVSystem(Reading& reading) : reading_(reading) {}

  // Handles EPD, FNO, NA, NAO, DIM, WL, REF, the fields and related words that are ignored. False for other words.
  bool take(int line, const std::vector<std::string>& words);
  // 0 if the file has none.
  double reference_wavelength_nm() const;
  // Call after the last line: applies units and the reference wavelength.
  LensDesign finish();

 private:
  bool take_fields(int line, const std::string& keyword, const std::vector<std::string>& words);

  Reading& reading_;
  double unit_mm_ = 1;
  bool unit_stated_ = false;
  std::vector<double> wavelengths_nm_, weights_;
  int reference_ = 1, reference_line_ = 0;
  std::vector<double> x_fields_, y_fields_;
  std::map<std::string, std::vector<double>> vignetting_;  // VUX, VLX, VUY, VLY of the fields
};

// Sets the glass of a surface from a word such as NBK7_SCHOTT (resolved by glasses.h), 1.5168:64.17 (nd and Vd),
// 517642, 517000.642000, AIR, or REFL for a mirror.
void take_glass(Surface& surface, int line, const std::string& word);

// Handles CIR words: [S3] [kind] radius. False if the kind is not the clear aperture.
bool take_circle(Reading& reading, int line, const std::vector<std::string>& words);

// The surface that a qualifier S3, SO or SI refers to; null for other words.
Surface* surface_of(Reading& reading, const std::string& qualifier);

// Tilt words of CODE V (ADE, BDE left-handed, CDE right-handed) and decentres as a motion.
struct Decentre {
  double x = 0, y = 0, z = 0, alpha_deg = 0, beta_deg = 0, gamma_deg = 0;
  bool returns = false;  // DAR
  // Handles XDE, YDE, ZDE, ADE, BDE, CDE; false for other keywords.
  bool take(Reading& reading, int line, const std::string& keyword, const std::string& value);
  void apply(Surface& surface) const;
};

// Sets the coefficient of K, A ... H, J on an asphere: conic or r^4 ... r^18, r^20. False for other keywords.
bool take_asphere(Reading& reading, Surface& surface, int line, const std::string& keyword, const std::string& value);

// Special surfaces (SPS) and their coefficients (SCO): K or C1 is the conic, ARn or C(n+1) the coefficient of r^n,
// NRADIUS or C33 the radius that r is divided by (SPS ODD). Coefficients of SPS QBF and SPS QCN are read by name only:
// K, NRADIUS, and QB4, QB6, ... or QC4, QC6, ... for a0, a1, ... of Forbes's polynomials.
class SpecialSurface {
 public:
  // Handles SPS, SCO and SCC; `at`: index of the first word after the keyword and the surface. False for other words.
  bool take(Reading& reading, const Surface& surface, int line, const std::vector<std::string>& words, std::size_t at);
  void apply(Reading& reading, Surface& surface) const;

 private:
  bool is_q_type() const { return kind_ == q_bfs || kind_ == q_con; }
  void take_q_coefficient(Reading& reading, const Surface& surface, int line, const std::string& name, double value);
  void apply_q_type(Reading& reading, Surface& surface) const;

  enum Kind { none, odd, q_bfs, q_con };
  Kind kind_ = none;
  int line_ = 0;
  double conic_ = 0, radius_ = 0;
  std::map<int, std::pair<int, double>> terms_;  // by power, or number of the Q-type coefficient: line and coefficient
};

}  // namespace relign::lens_files
