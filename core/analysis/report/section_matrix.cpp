// The generalisation matrix: methods by scenes and noise levels, shaded by excess error. Radio buttons choose the
// number of images, the rule and the unit; style rules show the table that they name, so that no script is needed.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "markup/html_writer.h"
#include "report/matrix_data.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxMatrixCells = 12'000;  // about 2 MB

struct View {
  unsigned images = kLastImage;
  statistics::Rule rule = statistics::Rule::own;
};

// Radio buttons with labels. A single option is selected and not shown. Class and id begin with `prefix`; page.css has
// rules for the classes.
void choice(HtmlWriter& html, const char* title, const std::string& prefix, const std::vector<std::string>& options,
            std::size_t chosen) {
  const bool shown = options.size() > 1;
  if (shown) html.element("span", {{"class", "lead"}}, title);
  for (std::size_t i = 0; i < options.size(); ++i) {
    const std::string number = prefix + std::to_string(i), id = "matrix-" + number;
    Attributes attributes = {{"type", "radio"}, {"name", "matrix-" + prefix}, {"id", id}, {"class", number}};
    if (i == chosen) attributes.emplace_back("checked", "");
    if (!shown) attributes.emplace_back("hidden", "");
    html.empty("input", attributes);
    if (shown) html.element("label", {{"for", id}}, options[i]);
  }
}

// The limits of the classes in words and colours.
void legend(HtmlWriter& html, const char* kind, const std::string& title, const std::array<double, 4>& limits,
            bool percent) {
  html.open("p", {{"class", "classes " + std::string(kind)}}).text(title + " ");
  for (std::size_t i = 0; i <= limits.size(); ++i) {
    const double limit = limits[std::min(i, limits.size() - 1)];
    const std::string text = percent ? shortest(rounded(100 * limit, 3)) + " %" : shortest(limit);
    html.element("span", {{"class", "m" + std::to_string(i)}}, (i < limits.size() ? "at most " : "above ") + text);
  }
  html.close();
}

std::string percent_text(double share) { return number_text(100 * share, 2) + " %"; }

void matrix_head(HtmlWriter& html, const PageModel& page, const MatrixPart& part, bool scenes) {
  html.open("thead");
  if (scenes) {
    html.open("tr").element("td", "");
    for (std::size_t first = 0, next = 0; first < part.domains.size(); first = next) {
      const std::string& scene = page.groups[part.domains[first]].scene;
      while (next < part.domains.size() && page.groups[part.domains[next]].scene == scene) ++next;
      html.open("th", {{"scope", "colgroup"}, {"class", "scene"}, {"colspan", std::to_string(next - first)}});
      html.element("bdi", scene).close();
    }
    html.close();
  }
  html.open("tr").element("th", {{"scope", "col"}, {"class", "name"}}, "method");
  for (const std::size_t index : part.domains) {
    const Group& group = page.groups[index];
    html.open("th", {{"scope", "col"}, {"class", "number"}})
        .open("a", {{"href", "#group-" + std::to_string(index)}})
        .element("bdi", group.noise_level)
        .close()
        .close();
  }
  html.close().open("tr", {{"class", "start"}});
  html.element("th", {{"scope", "row"}, {"class", "name"}}, "at the start");
  for (const std::size_t index : part.domains)
    html.element("td", {{"class", "number"}}, number_text(page.groups[index].start_excess, 3));
  html.close().close();
}

void matrix_cell(HtmlWriter& html, const Group& group, const Row* row, const View& view) {
  if (!row) {
    html.element("td", "");
    return;
  }
  const Score* score = excess_after(*row, view.images, view.rule);
  if (!score || score->n == 0) {
    const std::string why = row->trials == 0 ? counted(row->failed, "trial") + " failed"
                            : score          ? "not recorded for this rule"
                                    : "only " + counted(row->excess.empty() ? 0 : row->excess.back().images, "image");
    html.element("td", {{"class", "quiet"}, {"title", why}}, row->trials == 0 ? "failed" : "-");
    return;
  }
  const double share = score->median / group.start_excess;
  const bool fewer = score->n < group.instances;
  std::string title = score->interval.exists() ? interval_text(score->interval, 3, " to ") + " (95 % interval)"
                      : score->n > 1           ? interval_text({score->q25, score->q75}, 3, " to ") + " (quartiles)"
                                               : "no interval";
  title += ", " + (fewer ? std::to_string(score->n) + " of " : "") + counted(group.instances, "instance");
  if (row->failed > 0) title += ", " + counted(row->failed, "trial") + " failed";
  std::string classes = "a" + std::to_string(excess_class(score->median, kExcessClasses));
  if (std::isfinite(share)) classes += " b" + std::to_string(excess_class(share, kShareClasses));
  html.open("td", {{"class", classes}, {"title", title}}).text(excess_text(score->median) + (fewer ? "*" : ""));
  if (std::isfinite(share)) html.text(" ").element("small", percent_text(share));
  html.close();
}

void matrix_table(HtmlWriter& html, const PageModel& page, const Matrix& matrix, const MatrixPart& part,
                  const View& view) {
  html.open("table", {{"class", "heat excess"}});
  const std::string after = view.images == kLastImage ? "the last image" : std::to_string(view.images) + " images";
  html.element("caption", (matrix.parts.size() > 1 ? "Protocol " + part.protocol + ", after " : "After ") + after +
                              ", rule " + statistics::rule_name(view.rule));
  matrix_head(html, page, part, matrix.scenes > 1);
  ObservationClass block = ObservationClass::unknown;
  const bool blocks = part.rows.front().method->of_class != part.rows.back().method->of_class;
  for (const MatrixRow& row : part.rows) {
    if (&row == &part.rows.front() || row.method->of_class != block) {
      if (&row != &part.rows.front()) html.close();
      block = row.method->of_class;
      html.open("tbody");
      if (blocks)
        html.open("tr", {{"class", "class"}})
            .element("th", {{"colspan", std::to_string(1 + part.domains.size())}, {"scope", "rowgroup"}},
                     class_title(block))
            .close();
    }
    html.open("tr").open("th", {{"scope", "row"}, {"class", "name"}}).element("bdi", row.method->name);
    tag(html, row.method->training_tag);
    html.close();
    for (std::size_t domain = 0; domain < row.cells.size(); ++domain)
      matrix_cell(html, page.groups[part.domains[domain]], row.cells[domain], view);
    html.close();
  }
  html.close().close();
}

std::string explanation(const PageModel& page, const Matrix& matrix) {
  std::string text =
      "Excess error: the noise-free RMSE above that of the instance's own optimum, at the pose of the rule (own: "
      "recommended by the method; best: lowest measured error; current), median over the instances. Image k is step k; "
      "the capture at the start, step 0, does not count. ";
  if (matrix.shares && matrix.scenes > 1)
    text +=
        "RMSE is in the brightness of each scene's images, so columns of different lenses are not comparable in "
        "absolute terms: by default colours show the share of the excess at the start that remains. ";
  text += "Tooltips show intervals; column heads link to the curves; matrix.csv in the results folder has all numbers.";
  if (any_row(page, &Row::failed)) text += " *: fewer instances, since failed trials do not count.";
  if (matrix.domains < page.groups.size())
    text += " Not shown: " + counted(page.groups.size() - matrix.domains, "group") + " without known optima.";
  return text;
}

}  // namespace

std::string matrix_section(const PageModel& page) {
  const Matrix matrix = matrix_of(page);
  if (!has_matrix(matrix)) return "";
  std::vector<unsigned> images = matrix.images;
  images.push_back(kLastImage);
  std::vector<statistics::Rule> rules = matrix.rules;
  bool reduced = false;
  if (matrix.cells * images.size() * rules.size() > kMaxMatrixCells) rules = {page.rule}, reduced = true;
  if (matrix.cells * images.size() * rules.size() > kMaxMatrixCells) images = {kLastImage};
  HtmlWriter html;
  html.element("h2", "Excess error by scene and noise level")
      .element("p", {{"class", "quiet"}}, explanation(page, matrix));
  if (reduced)
    html.element("p", {{"class", "quiet"}},
                 "This page is large; matrix.csv has the other rules" +
                     std::string(images.size() == 1 ? " and numbers of images." : "."));
  html.open("div", {{"class", "matrix"}});
  std::vector<std::string> counts, names, units = {"RMSE"};
  for (const unsigned count : images) counts.push_back(images_text(matrix, count));
  for (const statistics::Rule rule : rules) names.push_back(statistics::rule_name(rule));
  if (matrix.shares) units.push_back("share of the start");
  const auto place = std::find(rules.begin(), rules.end(), page.rule) - rules.begin();
  choice(html, "Images", "i", counts, counts.size() - 1);
  choice(html, "Rule", "r", names, static_cast<std::size_t>(place) % rules.size());
  choice(html, "Colours", "u", units, matrix.shares && matrix.scenes > 1 ? 1 : 0);
  legend(html, "of-error", "Excess RMSE:", kExcessClasses, false);
  if (matrix.shares) legend(html, "of-share", "Share of the excess at the start:", kShareClasses, true);
  for (std::size_t i = 0; i < images.size(); ++i)
    for (std::size_t r = 0; r < rules.size(); ++r) {
      html.open("div", {{"class", "scroll view v" + std::to_string(i) + std::to_string(r)}});
      for (const MatrixPart& part : matrix.parts) matrix_table(html, page, matrix, part, {images[i], rules[r]});
      html.close();
    }
  return html.take();
}

}  // namespace relign::report
