#include "report/page_writer.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"

namespace relign::report {
namespace {

constexpr int kSortDigits = 6;

Attributes attributes_of(const std::string& kind, const std::string& hint) {
  Attributes attributes;
  if (!kind.empty()) attributes.emplace_back("class", kind);
  if (!hint.empty()) attributes.emplace_back("title", hint);
  return attributes;
}

}  // namespace

// A minus sign after a dash is hard to read.
std::string open_interval(const statistics::Interval& interval, int digits) {
  if (!std::isfinite(interval.low)) return "";
  return number_text(interval.low, digits) +
         (std::isfinite(interval.high) ? (interval.low < 0 ? " to " : kDash) + number_text(interval.high, digits)
                                       : " or more");
}

Cell number_cell(const std::string& text) { return {text, std::nullopt, "number"}; }
Cell number_cell(double value, int digits) {
  return {number_text(value, digits), sort_value(rounded(value, kSortDigits)), "number"};
}
Cell no_cell(const std::string& kind) { return {"-", "", kind}; }

Cell estimate_cell(double sort, const std::string& text, const std::string& interval, const std::string& hint) {
  Words words = {{text, "strong"}};
  if (!interval.empty()) words.add(" ").add("(" + interval + ")", "quartiles");
  return {words, sort_value(rounded(sort, kSortDigits)), "number", hint};
}

Cell share_cell(double share, const statistics::Interval& interval) {
  if (!std::isfinite(share)) return no_cell();
  return estimate_cell(share, whole_percent(share) + " %",
                       interval.exists() ? whole_percent(interval.low) + kDash + whole_percent(interval.high) : "");
}

Cell arrival_cell(double median, const statistics::Interval& interval) {
  if (std::isfinite(median)) return estimate_cell(median, number_text(median, 3), open_interval(interval, 3));
  return {std::isinf(median) ? "not reached" : "-", "", "number quiet"};
}

Cell range_cell(const statistics::Band& band) {
  Cell cell = {"", sort_value(band.estimate), "range"};
  const statistics::Interval& interval = band.interval;
  if (std::isfinite(band.estimate))
    cell.range = {interval.exists() ? interval.low : band.estimate, band.estimate,
                  interval.exists() ? interval.high : band.estimate};
  return cell;
}

Cell method_cell(const std::string& method, bool oracle, const std::string& training_tag) {
  Words words = {{method, "name"}};
  for (const std::string& tag : {std::string(oracle ? "oracle" : ""), training_tag})
    if (!tag.empty()) words.add(" ").add(tag, "tag");
  return {words, words.size() > 1 ? std::optional(method) : std::nullopt, "name"};
}

void Table::add_title(Words words, const std::string& row_kind) {
  const auto is_title = [](const TableRow& row) { return row.cells.size() == 1; };
  if (!bodies.back().empty() && !is_title(bodies.back().back())) bodies.emplace_back();
  bodies.back().push_back({{{std::move(words), std::nullopt, "", "", std::nullopt, heads.size()}}, row_kind});
}

void PageWriter::words(const Words& words) {
  for (const Word& word : words) {
    if (!word.link.empty()) {
      Attributes link = {{"href", word.link}};
      if (word.link.rfind("http", 0) == 0) link.emplace_back("rel", "nofollow noopener noreferrer");
      html_.open("a", link);
    }
    const std::string& look = word.look;
    const Attributes hint = attributes_of("", word.hint);
    if (look == "name")
      html_.element("bdi", hint, word.text);
    else if (look == "strong")
      html_.element("b", hint, word.text);
    else if (look == "code")
      html_.element("code", hint, word.text);
    else if (look.empty() && word.hint.empty())
      html_.text(word.text);
    else
      html_.element("span", attributes_of(word.look, word.hint), word.text);
    if (!word.link.empty()) html_.close();
  }
}

PageWriter& PageWriter::heading(int level, const Words& of, const std::string& id) {
  html_.open("h" + std::to_string(level), id.empty() ? Attributes() : Attributes{{"id", id}});
  words(of);
  html_.close();
  return *this;
}

PageWriter& PageWriter::text(const Words& of, const std::string& kind) {
  html_.open("p", attributes_of(kind, ""));
  words(of);
  html_.close();
  return *this;
}

PageWriter& PageWriter::list(const std::vector<Words>& items, const std::string& kind) {
  if (items.empty()) return *this;
  html_.open("ul", attributes_of(kind, ""));
  for (const Words& item : items) {
    html_.open("li");
    words(item);
    html_.close();
  }
  html_.close();
  return *this;
}

PageWriter& PageWriter::facts(const std::vector<std::pair<std::string, Words>>& facts) {
  html_.open("dl");
  for (const auto& [name, of] : facts) {
    if (std::all_of(of.begin(), of.end(), [](const Word& word) { return word.text.empty(); })) continue;
    html_.element("dt", name).open("dd");
    words(of);
    html_.close();
  }
  html_.close();
  return *this;
}

PageWriter& PageWriter::code(const std::string& text) {
  html_.open("pre").element("code", text).close();
  return *this;
}

void PageWriter::row(const TableRow& row, const std::vector<Head>& heads) {
  html_.open("tr", attributes_of(row.kind, ""));
  std::size_t column = 0;
  for (const Cell& cell : row.cells) {
    const bool title = cell.span == heads.size() && heads.size() > 1;
    const bool head = title || (column == 0 && cell.kind == "name");
    Attributes attributes = attributes_of(cell.kind, cell.hint);
    if (head) attributes.insert(attributes.begin(), {"scope", title ? "rowgroup" : "row"});
    if (cell.sort) attributes.emplace_back("data-sort", *cell.sort);
    if (cell.span > 1) attributes.emplace_back("colspan", std::to_string(cell.span));
    html_.open(head ? "th" : "td", attributes);
    words(cell.words);
    if (cell.range) {
      const auto percent = [](double share) { return significant(100 * std::clamp(share, 0.0, 1.0), 3) + "%"; };
      const auto [low, middle, high] = *cell.range;
      html_.element("span",
                    {{"style", "--low:" + percent(low) + ";--at:" + percent(middle) + ";--high:" + percent(high)}}, "");
    }
    html_.close();
    column += cell.span;
  }
  html_.close();
}

PageWriter& PageWriter::table(const Table& table) {
  // A region that can be scrolled sideways by keyboard, too.
  html_.open("div", {{"class", "scroll"}, {"tabindex", "0"}});
  html_.open("table", attributes_of((table.sortable ? "sortable " : "") + table.kind, ""));
  if (!table.caption.empty()) html_.element("caption", table.caption);
  html_.open("thead").open("tr");
  for (const Head& head : table.heads) {
    Attributes attributes = attributes_of(head.kind, head.hint);
    attributes.insert(attributes.begin(), {"scope", "col"});
    html_.open("th", attributes);
    if (!head.link.empty()) html_.open("a", {{"href", head.link}});
    html_.element("span", {{"class", "title"}}, head.title);
    if (!head.link.empty()) html_.close();
    if (!head.unit.empty()) html_.text(" ").element("span", {{"class", "unit"}}, head.unit);
    html_.close();
  }
  html_.close().close();
  for (const std::vector<TableRow>& body : table.bodies) {
    html_.open("tbody");
    for (const TableRow& one : body) row(one, table.heads);
    html_.close();
  }
  html_.close().close();
  return *this;
}

PageWriter& PageWriter::chart(const std::string& name, const std::string& caption, Json specification) {
  html_.open("figure", {{"class", "plot"}, {"data-chart", std::to_string(charts_.size())}, {"hidden", ""}});
  html_.element("div", {{"class", "chart"}}, "").element("figcaption", caption).close();
  charts_.push_back({{"name", name}, {"chart", std::move(specification)}});
  return *this;
}

PageWriter& PageWriter::chart(const Figure& figure) {
  return chart(figure.name, figure.caption, chart_json(figure.chart));
}

PageWriter& PageWriter::first_chart() {
  html_.open("figure", {{"class", "first-figure"}, {"id", "first-figure"}, {"hidden", ""}});
  html_.element("select", {{"id", "first-group"}, {"aria-label", "Group"}}, "");
  html_.element("div", {{"class", "chart"}, {"id", "first-chart"}}, "");
  html_.element("figcaption", {{"class", "quiet"}, {"id", "first-caption"}}, "").close();
  return *this;
}

PageWriter& PageWriter::choice(const std::string& title, const std::string& name,
                               const std::vector<std::string>& options, std::size_t chosen) {
  const bool shown = options.size() > 1;
  if (shown) html_.element("span", {{"class", "lead"}}, title);
  for (std::size_t i = 0; i < options.size(); ++i) {
    const std::string number = name + std::to_string(i), id = "choice-" + number;
    Attributes attributes = {{"type", "radio"}, {"name", "choice-" + name}, {"id", id}, {"class", number}};
    if (i == chosen) attributes.emplace_back("checked", "");
    if (!shown) attributes.emplace_back("hidden", "");
    html_.empty("input", attributes);
    if (shown) html_.element("label", {{"for", id}}, options[i]);
  }
  return *this;
}

PageWriter& PageWriter::open(const std::string& kind, const std::string& id) {
  Attributes attributes = attributes_of(kind, "");
  if (!id.empty()) attributes.emplace_back("id", id);
  html_.open("div", attributes);
  return *this;
}

PageWriter& PageWriter::unfold(const Words& summary, const std::string& kind, bool open) {
  Attributes attributes = attributes_of(kind, "");
  if (open) attributes.emplace_back("open", "");
  html_.open("details", attributes).open("summary");
  words(summary);
  html_.close();
  return *this;
}

PageWriter& PageWriter::close() {
  html_.close();
  return *this;
}

}  // namespace relign::report
