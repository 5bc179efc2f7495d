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

struct GlassSources {
  std::vector<GlassCatalogue> catalogues;            // the user's, looked through first
  std::function<bool(const std::string&)> is_known;  // built in, and codes such as 517642; may be empty
};

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

  LensDesign& design_;
  const GlassSources& sources_;
  double wavelength_nm_;
  OrderedJson own_ = OrderedJson::object();
  std::vector<Problem> problems_;
};

}  // namespace relign::lens_files
