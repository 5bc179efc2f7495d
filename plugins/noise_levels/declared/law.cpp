#include "law.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include "base/error.h"
#include "base/text.h"

namespace declared {
namespace {

using relign::Error;
using relign::ErrorKind;
using relign::Json;
using relign::JsonSource;
using relign::ObjectReader;
using relign::Problem;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Law read_law(const JsonSource& source, const std::string& pointer, std::vector<Problem>& problems) {
  ObjectReader reader(source, pointer, problems);
  Law law;
  const std::string kind = reader.required_string("law");
  if (reader.has("law") && kind != "normal" && kind != "uniform")
    reader.complain("law", "expected 'normal' or 'uniform', found '" + kind + "'");
  law.normal = kind != "uniform";
  if (law.normal) {
    law.mean = reader.number("mean", 0, -kInfinity, kInfinity);
    law.sigma = reader.required_number("sigma", 0, kInfinity);
    law.lower = reader.number("lower", -kInfinity, -kInfinity, kInfinity);
    law.upper = reader.number("upper", kInfinity, -kInfinity, kInfinity);
    // Otherwise nearly every draw would be rejected.
    if (!(law.lower <= law.mean && law.mean <= law.upper)) reader.complain("mean", "must be from 'lower' to 'upper'");
  } else {
    law.lower = reader.required_number("lower", -kInfinity, kInfinity);
    law.upper = reader.required_number("upper", -kInfinity, kInfinity);
  }
  if (!(law.lower < law.upper)) reader.complain("upper", "must be greater than 'lower'");
  reader.reject_unknown();
  return law;
}

// The numbers of a line that has as many as there are names; false for any other.
bool read_row(const std::string& line, std::size_t names, std::vector<double>& row) {
  row.clear();
  std::istringstream fields(line);
  for (std::string field; std::getline(fields, field, ',');) {
    std::istringstream text(field);
    double value = 0;
    if (!(text >> value) || !(text >> std::ws).eof() || !std::isfinite(value)) return false;
    row.push_back(value);
  }
  return row.size() == names;
}

std::string without_return(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line;
}

}  // namespace

std::vector<Quantity> declared_by(const JsonSource& scene) {
  std::vector<Problem> problems;
  std::vector<Quantity> quantities;
  const Json& root = scene.root();
  const Json list = root.value("uncertain", Json::array());
  for (std::size_t i = 0; i < list.size(); ++i)
    quantities.push_back(
        {list[i].value("name", ""), read_law(scene, "/uncertain/" + std::to_string(i) + "/law", problems)});
  relign::throw_if_any(problems);
  return quantities;
}

Laws read_laws(const JsonSource& file) {
  std::vector<Problem> problems;
  Laws laws;
  ObjectReader top(file, "", problems);
  if (const Json* given = top.get("quantities")) {
    ObjectReader all(file, "/quantities", problems);
    if (given->is_object())
      for (const auto& [name, law] : given->items())
        laws.quantities.push_back({name, read_law(file, all.pointer_to(name), problems)});
  }
  const Json* given = top.get("correlations");
  for (std::size_t i = 0; given && i < given->size(); ++i) {
    ObjectReader one(file, "/correlations/" + std::to_string(i), problems);
    const Json* names = one.get("of");
    if (!names || !names->is_array() || names->size() != 2 || !names->at(0).is_string() || !names->at(1).is_string() ||
        names->at(0) == names->at(1))
      one.complain("of", "expected the names of two quantities");
    else
      laws.correlations.push_back({{names->at(0), names->at(1)}, one.required_number("value", -1, 1)});
    one.reject_unknown();
  }
  top.reject_unknown();
  relign::throw_if_any(problems);
  return laws;
}

Draws read_draws(const std::string& file) {
  std::ifstream stream(file);
  const auto refuse = [&file](std::size_t line, const std::string& what) {
    throw Error(ErrorKind::bad_input, file + ":" + std::to_string(line) + ": " + what);
  };
  std::string line;
  if (!std::getline(stream, line)) refuse(1, "expected the names of quantities, separated by commas");
  Draws draws;
  std::istringstream head(without_return(line));
  for (std::string name; std::getline(head, name, ',');) {
    if (name.empty() || std::find(draws.names.begin(), draws.names.end(), name) != draws.names.end())
      refuse(1, "expected different names of quantities, found '" + name + "'");
    draws.names.push_back(name);
  }
  for (std::size_t number = 2; std::getline(stream, line); ++number) {
    std::vector<double> row;
    if (!read_row(without_return(line), draws.names.size(), row))
      refuse(number, "expected " + relign::counted(draws.names.size(), "number") + " separated by commas, found '" +
                         line.substr(0, 60) + "'");
    draws.rows.push_back(std::move(row));
  }
  if (draws.rows.empty()) refuse(2, "expected a row of numbers for each lens");
  return draws;
}

}  // namespace declared
