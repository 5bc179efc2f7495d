// Zemax multi-configuration files: the lines of another configuration, from the operands behind MNUM.
#pragma once

#include <vector>

#include "lens_files/lens_design.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {

// Changes the lines to what they are in configuration `wanted` (from 1; 0: as the file stands, with a remark where it
// has several). Operands that differ and are not supported are problems by name.
void choose_configuration(std::vector<TextLine>& lines, Reading& reading, int wanted);

}  // namespace relign::lens_files
