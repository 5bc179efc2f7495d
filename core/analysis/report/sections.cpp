#include "report/sections.h"

namespace relign::report {

void tag(HtmlWriter& html, const std::string& text) {
  if (!text.empty()) html.text(" ").element("span", {{"class", "tag"}}, text);
}

void column_head(HtmlWriter& html, const char* kind, const std::string& title, const std::string& unit,
                 const std::string& hint) {
  html.open("th", {{"scope", "col"}, {"class", kind}, {"title", hint}}).element("span", {{"class", "title"}}, title);
  if (!unit.empty()) html.text(" ").element("span", {{"class", "unit"}}, unit);
  html.close();
}

void table_head(HtmlWriter& html, std::initializer_list<const char*> titles) {
  html.open("thead").open("tr");
  for (const char* title : titles) html.element("th", {{"scope", "col"}}, title);
  html.close().close();
}

void method_cell(HtmlWriter& html, const std::string& method, bool oracle, const std::string& training_tag) {
  html.open("th", {{"scope", "row"}, {"class", "name"}, {"data-sort", method}}).element("bdi", method);
  tag(html, oracle ? "oracle" : "");
  tag(html, training_tag);
  html.close();
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
