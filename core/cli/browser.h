// Opens a page in the user's browser.
#pragma once

#include <filesystem>

namespace relign::cli {

// Starts $BROWSER (a list with ':', %s for the page), or the desktop's browser, and returns whether one has started or
// taken the page. If none has, for example on a machine without a display, prints to stderr why, and how to copy the
// page. The browser gets no terminal, and outlives this program.
bool open_in_browser(const std::filesystem::path& page);

}  // namespace relign::cli
