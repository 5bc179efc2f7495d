// The files of assets/ and dygraphs, as they were when the program was built.
#pragma once

#include <string>
#include <string_view>

namespace relign::report::assets {

std::string_view page_html();  // the template: {{name}} stands for a part
std::string_view page_css();
std::string_view page_js();
std::string_view sorting_js();
std::string_view curves_js();
std::string_view replay_js();
std::string_view dygraphs_licence();
// Without the line that names a source map: a browser's tools would ask for that file.
std::string dygraphs_js();
std::string dygraphs_css();

}  // namespace relign::report::assets
