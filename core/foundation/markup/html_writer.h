// Writes HTML in which everything is escaped: text and attribute values are escaped here, and there is
// no way to add raw markup.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relign {

using Attributes =
    std::vector<std::pair<std::string_view, std::string>>;  // names are literals of ours, values are escaped

class HtmlWriter {
 public:
  HtmlWriter& open(std::string_view tag, const Attributes& attributes = {});
  HtmlWriter& close();  // the innermost open element
  HtmlWriter& text(std::string_view text);
  HtmlWriter& element(std::string_view tag, const Attributes& attributes, std::string_view text);
  HtmlWriter& element(std::string_view tag, std::string_view text) { return element(tag, {}, text); }
  HtmlWriter& empty(std::string_view tag, const Attributes& attributes = {});  // <br>, <image ... />

  // Closes the open elements and returns the text.
  std::string take();

 private:
  void start(std::string_view tag, const Attributes& attributes);
  std::string out_;
  std::vector<std::string> open_;
};

}  // namespace relign
