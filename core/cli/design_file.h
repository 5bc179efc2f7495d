// Lenses from files, whatever wrote them: ours (.json), Zemax (.zmx), CODE V (.seq and its listing).
#pragma once

#include <string>
#include <vector>

#include "cli/app.h"
#include "lens_files/completion.h"
#include "lens_files/lens_design.h"

namespace relign::cli {

// How a design program's file is read.
struct DesignOptions {
  std::vector<std::string> glass_files;  // catalogues (.agf) to look names up in
  std::vector<std::string> aliases;      // NAME=NAME
  bool glass_from_file = false;
  int configuration = 0;       // 0: as the file stands
  double wavelength_nm = 0;    // 0: the file's reference wavelength
  bool polychromatic = false;  // an option of `scene new` alone
};
// --glass FILE and --alias NAME=NAME, both repeatable, --glass-from-file, --configuration N and
// --wavelength NM.
void add_design_options(CLI::App& verb, DesignOptions& options);

// A number in this range; `range` says it with the unit: who writes 0.55 for green light must see why not.
CLI::Validator from_to(double least, double most, const std::string& range);

struct DesignLens {
  lens_files::LensDesign design;
  lens_files::CompleteLens lens;
};

// A design program's file as `scene new` understands it. Throws Error.
DesignLens read_design_lens(const std::string& file, const DesignOptions& options, const std::string& name);

// Throws Error(bad_input) where an option is set: this lens is in no design program's file.
void refuse_design_options(const DesignOptions& options);

// The lens alone; what a design file leaves open is said on stderr. Throws Error.
optics::Prescription lens_of_file(const std::string& file, const DesignOptions& options);

}  // namespace relign::cli
