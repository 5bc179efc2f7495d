#include "optics/glass_catalogue.h"

#include <algorithm>
#include <iterator>

namespace relign::optics {
namespace {

constexpr std::size_t kMaxCoefficients = 9;

struct Row {
  const char* name;
  int agf_formula;
  double coefficients[kMaxCoefficients];
};

constexpr Row kSchott[] = {
#include "optics/glass_catalogue/schott.inc"
};
constexpr Row kOhara[] = {
#include "optics/glass_catalogue/ohara.inc"
};
constexpr Row kHoya[] = {
#include "optics/glass_catalogue/hoya.inc"
};
constexpr Row kHikari[] = {
#include "optics/glass_catalogue/hikari.inc"
};
constexpr Row kCdgm[] = {
#include "optics/glass_catalogue/cdgm.inc"
};
constexpr Row kSumita[] = {
#include "optics/glass_catalogue/sumita.inc"
};
constexpr Row kOlderSchott[] = {
#include "optics/glass_catalogue/schott_older.inc"
};
constexpr Row kZeon[] = {
#include "optics/glass_catalogue/zeon.inc"
};
constexpr Row kOther[] = {
#include "optics/glass_catalogue/other.inc"
};

template <std::size_t count>
void add(std::vector<PublishedGlass>& glasses, const char* vendor, const Row (&rows)[count]) {
  for (const Row& row : rows) {
    std::vector<double> coefficients(std::begin(row.coefficients), std::end(row.coefficients));
    coefficients.resize(std::min(kMaxCoefficients, coefficient_count(row.agf_formula)));
    glasses.push_back({vendor, {row.name, row.agf_formula, std::move(coefficients)}});
  }
}

std::vector<PublishedGlass> all_rows() {
  std::vector<PublishedGlass> glasses;
  add(glasses, "SCHOTT", kSchott);
  add(glasses, "OHARA", kOhara);
  add(glasses, "HOYA", kHoya);
  add(glasses, "HIKARI", kHikari);
  add(glasses, "CDGM", kCdgm);
  add(glasses, "SUMITA", kSumita);
  add(glasses, "SCHOTT", kOlderSchott);
  add(glasses, "ZEON", kZeon);
  add(glasses, "SPECIAL", kOther);  // as CODE V calls its catalogue of such materials
  return glasses;
}

}  // namespace

const std::vector<PublishedGlass>& published_glasses() {
  static const std::vector<PublishedGlass> glasses = all_rows();
  return glasses;
}

bool is_glass_vendor(const std::string& name) {
  const std::vector<PublishedGlass>& glasses = published_glasses();
  return !name.empty() &&
         std::any_of(glasses.begin(), glasses.end(), [&](const PublishedGlass& glass) { return glass.vendor == name; });
}

}  // namespace relign::optics
