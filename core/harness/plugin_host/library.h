// Plugin libraries: checks and loads them, and gets their tables of functions. Errors name what the library was built
// for, what is supported, and what to do.
#pragma once

#include <relign/plugin.h>

#include <cstddef>
#include <filesystem>
#include <string>

#include "plugin_host/manifest.h"

namespace relign::plugin_host {

// The library's description. Loads the library at the first call; it is never unloaded. Throws
// Error(plugin_rejected). Thread-safe.
const relign_plugin_description& load_library(const Manifest& manifest);

// The table of functions of one interface, of which the plugin must have filled at least `required_size` bytes.
// Throws Error(plugin_rejected).
const void* plugin_interface(const Manifest& manifest, const char* interface_id, std::size_t required_size);

// Throws Error(plugin_rejected) when a mandatory function of the interface is missing.
void require_function(const Manifest& manifest, const char* interface_id, const char* name, bool present);

// Why the file cannot be a complete shared library for this machine; empty if it can. The system's loader does not
// check this: with a truncated file the process dies of SIGBUS.
std::string check_shared_library(const std::filesystem::path& file);

// True when the member is within the `struct_size` bytes that the struct's writer filled.
#define RELIGN_HAS_MEMBER(pointer, member) \
  ((pointer)->struct_size >=               \
   offsetof(std::remove_cv_t<std::remove_reference_t<decltype(*(pointer))>>, member) + sizeof((pointer)->member))

}  // namespace relign::plugin_host
