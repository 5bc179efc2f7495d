// relign/plugin.hpp: write a plugin in C++17.
//
// Derive from Optimizer, Agent, NoiseLevel, Scene or Station, give the class a constructor from
// `const Parameters&`, and end the file with RELIGN_PLUGIN(YourClass). Build it with
// relign_add_plugin(name file.cpp) beside a relign-plugin.json. Everything here is inline;
// nothing but plugin.h and the standard library is included.
//
// Errors: throw std::exception (or anything) from any member; the wrapper turns it into a
// failure with its text. Nothing is thrown across the library's border.
#ifndef RELIGN_PLUGIN_HPP
#define RELIGN_PLUGIN_HPP

#include <relign/plugin.h>

#include <relign/algorithm.hpp>      // IWYU pragma: export
#include <relign/basics.hpp>         // IWYU pragma: export
#include <relign/border.hpp>         // IWYU pragma: export
#include <relign/noise_level.hpp>    // IWYU pragma: export
#include <relign/portable_math.hpp>  // IWYU pragma: export
#include <relign/random.hpp>         // IWYU pragma: export
#include <relign/scene.hpp>          // IWYU pragma: export
#include <relign/services.hpp>       // IWYU pragma: export
#include <relign/trial.hpp>          // IWYU pragma: export

// The manifest's bytes; relign_add_plugin generates their definition.
extern "C" const char relign_manifest_text[];

// Once, at the end of the plugin's main file.
#define RELIGN_PLUGIN(Class)                                                                      \
  extern "C" {                                                                                    \
  RELIGN_EXPORT extern const relign_plugin_description relign_plugin_entry;                       \
  const relign_plugin_description relign_plugin_entry = {sizeof(relign_plugin_description),       \
                                                         RELIGN_ABI_MAJOR,                        \
                                                         RELIGN_ABI_MINOR,                        \
                                                         0,                                       \
                                                         relign_manifest_text,                    \
                                                         "compiler " __VERSION__,                 \
                                                         ::relign::border::get_interface<Class>}; \
  }

#endif  // RELIGN_PLUGIN_HPP
