#include "plugin_host/nesting.h"

#include <relign/plugin.h>

namespace relign::plugin_host {

std::string nesting_mistake(const Manifest& outer, const Manifest& inner, bool start_is_hidden) {
  const auto observes = [](const Manifest& manifest, std::uint32_t what) {
    return (manifest.observed_bits() & what) != 0;
  };
  const bool outer_has_start = outer.oracle || (!start_is_hidden && observes(outer, RELIGN_OBSERVES_START));
  if (inner.oracle && !outer_has_start)
    return "'" + inner.id + "' cannot run inside '" + outer.id +
           "': it is an oracle, which needs the start pose, and '" + outer.id + "' does not get it here; list '" +
           inner.id + "' as a method of its own, or use the protocol 'paper'";
  return "";
}

}  // namespace relign::plugin_host
