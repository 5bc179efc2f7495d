// A picture of many captures with random imaging errors, for choosing the ranges of a file of imaging errors.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "cli/app.h"
#include "cli/chosen_lens.h"
#include "cli/workbench.h"

namespace relign::cli {

struct ContactSheet {
  LensChoice lens;  // the first of ten instances
  std::uint64_t seed = 0;
  std::string beside;  // another scene, captured as it is; empty: none
  std::string scene_id, out;
};

// `scene` has the imaging errors.
int render_contact_sheet(Context& context, const ContactSheet& sheet, const LoadedScene& scene);

}  // namespace relign::cli
