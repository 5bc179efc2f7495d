// The shape of one Zemax surface: what TYPE, PARM and XDAT mean together is known only when the surface ends.
#pragma once

#include <map>
#include <string>

#include "lens_files/lens_design.h"

namespace relign::lens_files {

class ZmxShape {
 public:
  void set_type(int line, const std::string& name);
  // PARM and XDAT lines: a number from 1 up and its value. Later ones replace earlier ones.
  void set_parameter(int line, int number, double value) { parameters_[number] = {line, value}; }
  void set_extra(int line, int number, double value) { extra_[number] = {line, value}; }

  // Fills conic and aspheric terms, or the coordinate break. A type that is not read is a problem.
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
  // Values with a number above `last`, which the type does not use.
  void list_unused(Reading& reading, const Surface& surface, const char* word, const Entries& entries, int last) const;

  std::string type_ = "STANDARD";
  int line_ = 0;
  Entries parameters_, extra_;
};

}  // namespace relign::lens_files
