// The commands that hints and errors name, as the user can type them: "./relign-bench try", if the program was started
// as ./relign-bench. Texts that last (reports, generated files, --help) name relign-bench instead.
#pragma once

#include <string>
#include <string_view>

namespace relign {

// argv[0] of this program. Call it before threads start; without it, commands begin with "relign-bench".
void set_own_program(std::string typed);

// The program and `arguments`, which are already quoted for the shell.
std::string own_command(std::string_view arguments);

// The same for a user who has changed to another folder.
std::string own_command_elsewhere(std::string_view arguments);

}  // namespace relign
