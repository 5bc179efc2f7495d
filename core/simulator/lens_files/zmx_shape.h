// The shape of one Zemax surface. Collects TYPE, PARM and XDAT, whose meanings depend on each other.
#pragma once

#include <map>
#include <string>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

class ZmxShape {
 public:
  void set_type(int line, const std::string& name);
  // PARM and XDAT lines: a number from 1 up and its value. Later lines override earlier ones.
  void set_parameter(int line, int number, double value) { parameters_[number] = {line, value}; }
  void set_extra(int line, int number, double value) { extra_[number] = {line, value}; }

  // Sets aspheric terms, or the coordinate break. Adds a problem for an unsupported type.
  void apply(Reading& reading, Surface& surface) const;

 private:
  struct Entry {
    int line = 0;
    double value = 0;
  };
  using Entries = std::map<int, Entry>;

  static double value_of(const Entries& entries, int number);
  void apply_break(Reading& reading, Surface& surface) const;
  // Terms 1, 2, ... of (r / radius)^(step n), from the entries after `before`.
  void apply_terms(Reading& reading, Surface& surface, const Entries& entries, int before, int terms, double radius,
                   int step) const;
  void apply_extended(Reading& reading, Surface& surface, int step) const;
  void apply_q_type(Reading& reading, Surface& surface) const;
  // Remarks on values numbered above `last`, which the type does not use.
  void list_unused(Reading& reading, const Surface& surface, const char* word, const Entries& entries, int last) const;

  std::string type_ = "STANDARD";
  int line_ = 0;
  Entries parameters_, extra_;
};

}  // namespace relign::lens_files
