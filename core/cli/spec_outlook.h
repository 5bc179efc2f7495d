// Whether a specification can be met before anything is run: by the lens as designed, and by how many lenses of a noise
// level.
#pragma once

#include <string>

#include "cli/app.h"
#include "cli/workbench.h"
#include "records/specification.h"
#include "trials/reachable.h"

namespace relign::cli {

struct SpecOutlook {
  trials::PossibleYield yield;
  std::string lenses;   // "21 of 24 lenses (69 to 96 %)"; empty if none was drawn, or no limit can be judged so
  std::string warning;  // empty: design and some lenses can meet it
};

// Draws `lenses` lenses from `level` and searches for their best poses, with progress on stderr. Throws Error;
// `stopped` after Ctrl-C.
SpecOutlook spec_outlook(Context& context, const LoadedScene& scene, const plugin_host::Choice& level,
                         const records::Specification& spec, std::uint64_t lenses);

Json outlook_json(const SpecOutlook& outlook);

}  // namespace relign::cli
