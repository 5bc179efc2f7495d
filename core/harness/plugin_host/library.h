// Plugin libraries: checking, loading, asking for the table of functions. A refusal says what the
// library was built for, what is supported, and what to do.
#pragma once

#include <relign/plugin.h>

#include <cstddef>
#include <filesystem>
#include <string>

#include "plugin_host/manifest.h"

namespace relign::plugin_host {

// The library's description, loaded at the first call and never unloaded. Throws
// Error(plugin_refused). Any thread.
const relign_plugin_description& load_library(const Manifest& manifest);

// The table of functions of one interface, whose first `required_size` bytes the writer filled.
// Throws Error(plugin_refused).
const void* plugin_interface(const Manifest& manifest, const char* interface_id, std::size_t required_size);

// Throws Error(plugin_refused) when a function that every plugin of this interface has is missing.
void require_function(const Manifest& manifest, const char* interface_id, const char* name, bool present);

// Why the file cannot be a complete shared library for this machine, or an empty text. The system's
// loader does not check this: it maps a truncated file and dies of SIGBUS.
std::string check_shared_library(const std::filesystem::path& file);

// True when a struct of which the writer filled `struct_size` bytes contains the member.
#define RELIGN_HAS_MEMBER(pointer, member) \
  ((pointer)->struct_size >=               \
   offsetof(std::remove_cv_t<std::remove_reference_t<decltype(*(pointer))>>, member) + sizeof((pointer)->member))

}  // namespace relign::plugin_host
