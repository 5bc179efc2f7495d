// What the simulator adds to verbs of the harness, and verbs of more than one file.
#pragma once

#include "cli/app.h"

namespace relign::cli {

// Drawings of lenses, because reports do not depend on optics; doctor's lines on instruction sets and, if component gpu
// is built, the GPU.
void extend_harness(Extensions& extensions);

// Below lens.
void add_lens_mesh(CLI::App& lens, Context& context);
void add_lens_draw(CLI::App& lens, Context& context);

}  // namespace relign::cli
