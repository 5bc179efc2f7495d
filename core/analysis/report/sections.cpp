#include "report/sections.h"

namespace relign::report {

void tag(HtmlWriter& html, const std::string& text) {
  if (!text.empty()) html.text(" ").element("span", {{"class", "tag"}}, text);
}

void interval_cell(HtmlWriter& html, const std::string& kind, const std::string& sort, const std::string& value,
                   const std::string& interval, const std::string& title) {
  Attributes attributes = {{"class", kind}, {"data-sort", sort}};
  if (!title.empty()) attributes.emplace_back("title", title);
  html.open("td", attributes).element("b", value);
  if (!interval.empty()) html.text(" ").element("span", {{"class", "quartiles"}}, "(" + interval + ")");
  html.close();
}

}  // namespace relign::report
