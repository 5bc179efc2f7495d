#include "report/assets.h"

extern "C" {
#define RELIGN_EMBEDDED(name)                        \
  extern const unsigned char relign_report_##name[]; \
  extern const unsigned long relign_report_##name##_size;
RELIGN_EMBEDDED(page_html)
RELIGN_EMBEDDED(page_css)
RELIGN_EMBEDDED(page_js)
RELIGN_EMBEDDED(sorting_js)
RELIGN_EMBEDDED(curves_js)
RELIGN_EMBEDDED(replay_js)
RELIGN_EMBEDDED(dygraphs_licence)
RELIGN_EMBEDDED(dygraphs_js)
RELIGN_EMBEDDED(dygraphs_css)
#undef RELIGN_EMBEDDED
}

namespace relign::report::assets {
namespace {

std::string_view view(const unsigned char* bytes, unsigned long size) {
  return {reinterpret_cast<const char*>(bytes), size};
}

std::string without_source_map(std::string_view text) {
  const std::size_t found = text.rfind("sourceMappingURL=");
  if (found == std::string_view::npos) return std::string(text);
  const std::size_t line = text.rfind('\n', found);
  return std::string(text.substr(0, line == std::string_view::npos ? 0 : line + 1));
}

}  // namespace

std::string_view page_html() { return view(relign_report_page_html, relign_report_page_html_size); }
std::string_view page_css() { return view(relign_report_page_css, relign_report_page_css_size); }
std::string_view page_js() { return view(relign_report_page_js, relign_report_page_js_size); }
std::string_view curves_js() { return view(relign_report_curves_js, relign_report_curves_js_size); }
std::string_view sorting_js() { return view(relign_report_sorting_js, relign_report_sorting_js_size); }
std::string_view replay_js() { return view(relign_report_replay_js, relign_report_replay_js_size); }
std::string_view dygraphs_licence() {
  return view(relign_report_dygraphs_licence, relign_report_dygraphs_licence_size);
}
std::string dygraphs_js() {
  return without_source_map(view(relign_report_dygraphs_js, relign_report_dygraphs_js_size));
}
std::string dygraphs_css() {
  return without_source_map(view(relign_report_dygraphs_css, relign_report_dygraphs_css_size));
}

}  // namespace relign::report::assets
