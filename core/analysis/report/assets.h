// The files of assets/, embedded at build time by relign_embed_file(relign_NAME ...).
#pragma once

#include <string_view>

// Defines NAME(), the file's text, in a namespace.
#define RELIGN_EMBEDDED(name_space, name)                                                                  \
  extern "C" const unsigned char relign_##name[];                                                          \
  extern "C" const unsigned long relign_##name##_size;                                                     \
  namespace name_space {                                                                                   \
  std::string_view name() { return {reinterpret_cast<const char*>(relign_##name), relign_##name##_size}; } \
  }

namespace relign::report::assets {

std::string_view page_html();    // the template with {{name}} placeholders
std::string_view replay_html();  // the viewer of films, around their strips
std::string_view page_css();
std::string_view page_js();  // all scripts

}  // namespace relign::report::assets
