// What a surface's glass becomes in a lens file: an index, a name, or a name with its dispersion beside it. A glass is
// never replaced by another one.
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
  std::vector<GlassCatalogue> catalogues;            // the user's, looked through first
  std::function<bool(const std::string&)> is_known;  // built in, and codes such as 517642; may be empty
  // The built-in glass that a name means with its vendor, in lower case or without hyphens; empty: none. May be empty.
  std::function<std::string(const std::string&)> known_like;
  std::vector<GlassAlias> aliases;  // the user's; names count in any case
  bool from_file = false;           // nd and Vd beside a name in the lens file count where the name is unknown
};

// "BK7=N-BK7". Throws Error(bad_input) for other texts.
GlassAlias parse_alias(const std::string& text);

// Decides for one lens at one wavelength.
class GlassChoice {
 public:
  GlassChoice(LensDesign& design, const GlassSources& sources, double wavelength_nm);

  // Writes "index_after" or "glass_after" into a face; remembers a problem for a glass that nobody knows.
  void write(const Surface& surface, OrderedJson& face);
  // The lens file's "glasses": all that came from catalogues and model glasses.
  const OrderedJson& own_glasses() const { return own_; }
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  bool from_catalogue(const Surface& surface, const std::string& name);
  // The name under which lens.json has the glass; empty for an unknown one.
  std::string resolved(const Surface& surface);
  void remark(const Surface& surface, const std::string& text);

  LensDesign& design_;
  const GlassSources& sources_;
  double wavelength_nm_;
  OrderedJson own_ = OrderedJson::object();
  std::vector<Problem> problems_;
};

}  // namespace relign::lens_files
