// Words for scripts and commands that people copy.
#pragma once

#include <string>
#include <string_view>

namespace relign {

// One word for a POSIX shell, in quotes unless it needs none: a shell takes it as it stands, whatever is in it.
std::string shell_quoted(std::string_view word);

}  // namespace relign
