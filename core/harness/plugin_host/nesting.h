// Which algorithms may run inside others.
#pragma once

#include <string>

#include "plugin_host/manifest.h"

namespace relign::plugin_host {

// Why `inner` cannot run inside `outer`, as a sentence; "" if it can. start_is_hidden: by the protocol or a station.
std::string nesting_mistake(const Manifest& outer, const Manifest& inner, bool start_is_hidden);

}  // namespace relign::plugin_host
