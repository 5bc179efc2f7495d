// Reads lenses from files of any supported format: relign-bench (.json), Zemax (.zmx), CODE V (.seq and listing).
#pragma once

#include <string>
#include <vector>

#include "cli/app.h"
#include "lens_files/completion.h"
#include "lens_files/lens_design.h"

namespace relign::cli {

// Options for files of design programs.
struct DesignOptions {
  std::vector<std::string> glass_files;  // catalogues (.agf) to look up glass names in
  std::vector<std::string> aliases;      // NAME=NAME
  bool glass_from_file = false;
  int configuration = 0;       // 0: the one that is active in the file
  double wavelength_nm = 0;    // 0: the file's reference wavelength
  bool polychromatic = false;  // an option of `scene new` alone
};
// Adds --glass and --alias, both repeatable, --glass-from-file, --configuration and --wavelength.
void add_design_options(CLI::App& verb, DesignOptions& options);

// Validates a number from `least` to `most`. `range` is the same with the unit, for the message: a wavelength of 0.55
// must be recognisable as micrometres.
CLI::Validator from_to(double least, double most, const std::string& range);

struct DesignLens {
  lens_files::LensDesign design;
  lens_files::CompleteLens lens;
};

// Reads the file of a design program, for `scene new`. Throws Error.
DesignLens read_design_lens(const std::string& file, const DesignOptions& options, const std::string& name);

// For a lens that does not come from a design program: throws Error(bad_input) if an option is set.
void refuse_design_options(const DesignOptions& options);

// Only the lens; prints remarks on the design file to stderr. Throws Error.
optics::Prescription lens_of_file(const std::string& file, const DesignOptions& options);

}  // namespace relign::cli
