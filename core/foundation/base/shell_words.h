// Quotes words for shell scripts and for commands that users copy.
#pragma once

#include <string>
#include <string_view>

namespace relign {

// `word` as one word for a POSIX shell, in single quotes where needed, so that the shell expands nothing in it.
std::string shell_quoted(std::string_view word);

}  // namespace relign
