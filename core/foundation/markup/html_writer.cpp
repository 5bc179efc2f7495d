#include "markup/html_writer.h"

#include "markup/escape.h"

namespace relign {

void HtmlWriter::start(std::string_view tag, const Attributes& attributes) {
  out_ += '<';
  out_ += tag;
  for (const auto& [name, value] : attributes) {
    out_ += ' ';
    out_ += name;
    out_ += "=\"" + html_escaped(value) + '"';
  }
}

HtmlWriter& HtmlWriter::open(std::string_view tag, const Attributes& attributes) {
  start(tag, attributes);
  out_ += '>';
  open_.emplace_back(tag);
  return *this;
}

HtmlWriter& HtmlWriter::close() {
  if (open_.empty()) return *this;
  out_ += "</" + open_.back() + '>';
  // One line per block keeps the page's source readable; inline elements must not gain spaces.
  const std::string& tag = open_.back();
  if (tag == "tr" || tag == "p" || tag == "li" || tag == "div" || tag == "section" || tag == "figure" ||
      tag == "details" || tag == "table" || tag == "tbody")
    out_ += '\n';
  open_.pop_back();
  return *this;
}

HtmlWriter& HtmlWriter::text(std::string_view text) {
  out_ += html_escaped(text);
  return *this;
}

HtmlWriter& HtmlWriter::element(std::string_view tag, const Attributes& attributes, std::string_view content) {
  return open(tag, attributes).text(content).close();
}

HtmlWriter& HtmlWriter::empty(std::string_view tag, const Attributes& attributes) {
  start(tag, attributes);
  out_ += "/>";
  return *this;
}

std::string HtmlWriter::take() {
  while (!open_.empty()) close();
  return std::move(out_);
}

}  // namespace relign
