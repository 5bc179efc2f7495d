// Resolves a surface's glass for the lens file: to an index, a name, or a name with its own dispersion. Never replaces
// a glass by another one.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lens_files/agf_reader.h"
#include "lens_files/lens_design.h"

namespace relign::lens_files {

using OrderedJson = nlohmann::ordered_json;

struct GlassCatalogue {
  std::string file;
  std::vector<CatalogueGlass> glasses;
};

struct GlassAlias {
  std::string from, to;
};

struct GlassSources {
  std::vector<GlassCatalogue> catalogues;            // the user's, searched first
  std::function<bool(const std::string&)> is_known;  // built in, and codes such as 517642; may be empty
  // Finds a built-in glass by a name with its vendor, in lower case or without hyphens; returns "" if none. May be
  // empty.
  std::function<std::string(const std::string&)> known_like;
  std::vector<GlassAlias> aliases;  // the user's; names are case-insensitive
  bool from_file = false;           // for unknown names, use nd and Vd stated in the lens file
};

// "BK7=N-BK7". Throws Error(bad_input) for other texts.
GlassAlias parse_alias(const std::string& text);

// The medium behind a face: an index or a glass's name. Neither: air, or an unknown glass.
struct GlassBehind {
  double index = 0;
  std::string name;
};

// Resolves the glasses of one lens at one wavelength.
class GlassChoice {
 public:
  GlassChoice(LensDesign& design, const GlassSources& sources, double wavelength_nm);

  // Adds a problem for an unknown glass.
  GlassBehind of(const Surface& surface);
  // The lens file's "glasses": those from catalogues, and model glasses.
  const OrderedJson& own_glasses() const { return own_; }
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  bool from_catalogue(const Surface& surface, const std::string& name);
  // The glass's name in lens.json; empty if unknown.
  std::string resolved(const Surface& surface);
  void remark(const Surface& surface, const std::string& text);

  LensDesign& design_;
  const GlassSources& sources_;
  double wavelength_nm_;
  OrderedJson own_ = OrderedJson::object();
  std::vector<Problem> problems_;
};

}  // namespace relign::lens_files
