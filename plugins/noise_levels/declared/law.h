// The laws of uncertain quantities: as a scene declares them, as a file of laws replaces them, and correlations.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/json_source.h"

namespace declared {

struct Law {
  bool normal = true;
  double mean = 0, sigma = 0;   // of a normal law
  double lower = 0, upper = 0;  // of a uniform one; of a normal one it is truncated there
  double middle() const { return normal ? mean : (lower + upper) / 2; }
  bool operator==(const Law&) const = default;
};

struct Quantity {
  std::string name;
  Law law;
};

// The quantities of a scene's description, in its order. Throws relign::Error(bad_input) that lists every mistake.
std::vector<Quantity> declared_by(const relign::JsonSource& scene);

struct Laws {
  std::vector<Quantity> quantities;
  std::vector<std::pair<std::pair<std::string, std::string>, double>> correlations;
};
// A file: {"quantities": {"waist": LAW}, "correlations": [{"of": ["waist", "gap"], "value": 0.5}]}. Throws likewise.
Laws read_laws(const relign::JsonSource& file);

// Measured lenses: a row of values for each. Throws likewise.
struct Draws {
  std::vector<std::string> names;
  std::vector<std::vector<double>> rows;
};
Draws read_draws(const std::string& file);

}  // namespace declared
