#include "lens_files/lens_design.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {

std::optional<double> LensDesign::object_distance_mm() const {
  const double thickness_mm = surfaces.front().thickness_mm;
  return std::fabs(thickness_mm) < kInfinite ? std::optional<double>(thickness_mm + first_vertex_mm) : std::nullopt;
}

double LensDesign::beam_distance_mm() const { return std::max(0.0, object_distance_mm().value_or(0)); }

Reading::Reading(const std::string& file, const std::string& format) {
  design.file = file;
  design.format = format;
}

void Reading::remark(int line, const std::string& key, const std::string& text) {
  const auto [known, is_new] = remark_of_key_.emplace(key, design.remarks.size());
  if (is_new)
    design.remarks.push_back({line, text, 0});
  else
    ++design.remarks[known->second].more_lines;
}

void Reading::not_understood(int line, const std::string& keyword, const std::string& text) {
  constexpr std::size_t kShown = 60;
  remark(line, "not understood " + keyword, "not understood: " + shown(text, kShown));
}

void Reading::problem(int line, const std::string& message) {
  constexpr std::size_t kMaxListed = 20;
  if (problems_.size() < kMaxListed)
    problems_.push_back({design.file, line, 0, "", message});
  else
    ++omitted_problems_;
}

double Reading::number(int line, const std::string& word, const std::string& what, double limit) {
  const std::optional<double> value = parse_number(word);
  if (value && std::fabs(*value) <= limit) return *value;
  problem(line, what + ": expected a number" +
                    (limit < 1e30 ? " from -" + shortest(limit) + " to " + shortest(limit) : "") + ", found '" +
                    shown(word, 40) + "'");
  return 0;
}

int Reading::integer(int line, const std::string& word, const std::string& what) {
  constexpr double kMost = 1e6;
  const double value = number(line, word, what, kMost);
  if (value != std::floor(value)) problem(line, what + ": expected an integer, found '" + shown(word, 40) + "'");
  return static_cast<int>(value);
}

void Reading::aperture(int line, const std::string& keyword, SystemAperture::Kind kind, const std::string& value) {
  SystemAperture& known = design.aperture;
  if (known.kind != SystemAperture::none)
    remark(known.line, "aperture", "not used: " + known.word + "; line " + std::to_string(line) + " states " + keyword);
  known = {kind, 0, line, keyword};
  if (kind == SystemAperture::stop_size) return;
  const std::optional<double> given = parse_number(value);
  known.value = number(line, value, keyword);
  // number() reports words that are not numbers.
  if (given && std::isfinite(*given) && *given <= 0)
    problem(line, keyword + ": expected a system aperture above 0, found " + shortest(*given));
}

Surface& Reading::add_surface(int line, const std::string& label) {
  if (design.surfaces.size() >= kMaxSurfaces) {
    problem(line, "more than " + std::to_string(kMaxSurfaces) + " surfaces are not supported");
    throw_if_any(finish().problems);
  }
  design.surfaces.emplace_back();
  design.surfaces.back().line = line;
  design.surfaces.back().label = label;
  return design.surfaces.back();
}

LensDesign Reading::finish() {
  if (omitted_problems_ > 0)
    problems_.push_back({design.file, 0, 0, "", "and " + std::to_string(omitted_problems_) + " more mistakes"});
  design.problems = problems_;
  return std::move(design);
}

std::optional<double> millimetres(const std::string& unit) {
  static const std::map<std::string, double> kUnits = {{"MM", 1},   {"CM", 10},      {"IN", 25.4},    {"INCH", 25.4},
                                                       {"M", 1000}, {"METER", 1000}, {"INCHES", 25.4}};
  const auto known = kUnits.find(unit);
  return known == kUnits.end() ? std::nullopt : std::optional<double>(known->second);
}

void set_term(Surface& surface, int power, double coefficient) {
  std::vector<double>& terms = power % 2 == 0 ? surface.even_asphere : surface.odd_asphere;
  const auto place = static_cast<std::size_t>(power - 2) / 2;
  if (terms.size() <= place) terms.resize(place + 1);
  terms[place] = coefficient;
}

void scale(LensDesign& design, double factor) {
  if (factor == 1) return;
  for (Surface& surface : design.surfaces) {
    surface.curvature /= factor;
    double power = factor;  // of the coefficient's unit: r^2 has 1/mm
    for (double& coefficient : surface.even_asphere) {
      coefficient /= power;
      power *= factor * factor;
    }
    power = factor * factor;  // r^3 has 1/mm^2
    for (double& coefficient : surface.odd_asphere) {
      coefficient /= power;
      power *= factor * factor;
    }
    for (std::optional<QAsphere>* asphere : {&surface.q_bfs, &surface.q_con}) {
      if (!*asphere) continue;
      (*asphere)->radius_mm *= factor;
      for (double& coefficient : (*asphere)->coefficients) coefficient *= factor;
    }
    if (std::fabs(surface.thickness_mm) < kInfinite) surface.thickness_mm *= factor;
    surface.clear_radius_mm *= factor;
    for (std::optional<optics::Motion>* motion : {&surface.before, &surface.after})
      if (*motion) (*motion)->translation = factor * (*motion)->translation;
  }
  if (design.aperture.kind == SystemAperture::entrance_pupil_diameter) design.aperture.value *= factor;
  if (design.field.kind != FieldSize::angle_deg && design.field.kind != FieldSize::none) design.field.value *= factor;
  for (auto& [name, value] : design.published)
    if (name != "f_number") value *= factor;
}

optics::Motion coordinate_break(const optics::Vec3& shift, double rx_deg, double ry_deg, double rz_deg,
                                bool tilt_first) {
  if (!tilt_first) return {optics::rotation_of_degrees(rx_deg, ry_deg, rz_deg), shift};
  const optics::Rotation tilt = optics::product(
      optics::product(optics::rotation_of_degrees(0, 0, rz_deg), optics::rotation_of_degrees(0, ry_deg, 0)),
      optics::rotation_of_degrees(rx_deg, 0, 0));
  return {tilt, optics::turn(tilt, shift)};
}

}  // namespace relign::lens_files
