// The position of a check, so that a crash can be located.
#pragma once

#include <string>

#include "plugin_host/manifest.h"

namespace relign::conformance {

// "with merits that are NaN": stored with the finding, and used when no finding follows.
void at(const std::string& where);

// Whether the plugin is a shared library; others run as processes.
bool is_library(const plugin_host::Manifest& manifest);

}  // namespace relign::conformance
