// The files of assets/, embedded at build time.
#pragma once

#include <string_view>

namespace relign::report::assets {

std::string_view page_html();  // the template with {{name}} placeholders
std::string_view page_css();
std::string_view page_js();  // all scripts

}  // namespace relign::report::assets
