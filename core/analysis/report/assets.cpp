#include "report/assets.h"

#define RELIGN_EMBEDDED(name)                                                                  \
  extern "C" const unsigned char relign_report_##name[];                                       \
  extern "C" const unsigned long relign_report_##name##_size;                                  \
  std::string_view relign::report::assets::name() {                                            \
    return {reinterpret_cast<const char*>(relign_report_##name), relign_report_##name##_size}; \
  }
RELIGN_EMBEDDED(page_html)
RELIGN_EMBEDDED(page_css)
RELIGN_EMBEDDED(page_js)
