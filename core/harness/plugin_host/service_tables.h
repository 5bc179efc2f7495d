// The tables of a trial's services, by id. What is included is made by the build from core/plugin_api/services.toml.
#pragma once

#include <relign/plugin.h>

#include <string_view>

namespace relign::plugin_host {

// A function of a table, as a type.
template <auto Function>
struct Member {
  static constexpr auto pointer = Function;
};

#include "service_tables.inc"

}  // namespace relign::plugin_host
