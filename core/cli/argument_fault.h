// What is wrong with the command line, in the words of this program.
#pragma once

#include <string>

namespace relign::cli {

// `text` is that of CLI11's exception: "--workers: Value 0 not in range 1 to 1024" becomes "--workers: found '0',
// expected 1 to 1024". A text that is not known is returned as it is.
std::string argument_fault(const std::string& text);

}  // namespace relign::cli
