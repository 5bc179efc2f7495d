// Where a check is, so that a crash can be told where it happened.
#pragma once

#include <string>

#include "plugin_host/manifest.h"

namespace relign::conformance {

// "with merits that are NaN": written beside the finding, and used when no finding follows.
void at(const std::string& where);

// Whether the plugin is a shared library; the others are programs that the host talks to.
bool is_library(const plugin_host::Manifest& manifest);

}  // namespace relign::conformance
