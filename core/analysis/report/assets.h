// The files of assets/ and of dygraphs, embedded at build time.
#pragma once

#include <string>
#include <string_view>

namespace relign::report::assets {

std::string_view page_html();  // the template with {{name}} placeholders
std::string_view page_css();
std::string_view page_js();
std::string_view sorting_js();
std::string_view curves_js();
std::string_view replay_js();
std::string_view dygraphs_licence();
// Without the reference to a source map, which browser tools would request.
std::string dygraphs_js();
std::string dygraphs_css();

}  // namespace relign::report::assets
