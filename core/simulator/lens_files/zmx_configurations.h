// Selects a configuration of a Zemax multi-configuration file, from the operands after MNUM.
#pragma once

#include <vector>

#include "lens_files/lens_design.h"
#include "lens_files/text_lines.h"

namespace relign::lens_files {

// Edits the lines for configuration `wanted` (from 1; 0: the file's current one, with a remark if there are several).
// Adds a problem for each operand that differs and is not supported.
void choose_configuration(std::vector<TextLine>& lines, Reading& reading, int wanted);

}  // namespace relign::lens_files
