// Methods by scenes and noise levels. The generalisation matrix is shaded by excess error; radio buttons choose the
// number of images, the rule and the unit, and style rules show the table that they name, so that no script is needed.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "report/matrix_data.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxMatrixCells = 12'000;  // about 2 MB

// Limits of the shades 0 (best) to 4: of the error relative to the best of the column, or of the yield.
constexpr double kFactors[] = {1.1, 1.5, 2.5, 5};
constexpr double kYields[] = {0.95, 0.8, 0.5, 0.2};

constexpr std::size_t kMaxLevelMethods = 10;  // more bars are indistinguishable

Cell heat_yield(const Row& row) {
  if (!row.yield) return {""};
  const auto shade =
      std::count_if(std::begin(kYields), std::end(kYields), [&](double y) { return row.yield->share < y; });
  const statistics::Interval& interval = row.yield->interval;
  return {whole_percent(row.yield->share), std::nullopt, "h" + std::to_string(shade),
          interval_text({100 * interval.low, 100 * interval.high}, 3, " to ") + " % (95 % interval)"};
}

Cell heat_error(const Row& row, double best) {
  const Score& error = row.score();
  if (error.n == 0) return {""};
  const double factor = best > 0 ? error.median / best : 1;
  const auto shade = std::count_if(std::begin(kFactors), std::end(kFactors), [&](double f) { return factor > f; });
  return {number_text(error.median, 3), std::nullopt, "h" + std::to_string(shade),
          error.interval.exists() ? interval_text(error.interval, 3, " to ") + " (95 % interval)"
                                  : interval_text({error.q25, error.q75}, 3, " to ") + " (quartiles)"};
}

double best_of(const Group& group) {
  double best = 0;
  for (const Row& row : group.rows) {
    const double median = row.score().median;
    if (!row.oracle() && median > 0 && (best == 0 || median < best)) best = median;
  }
  return best;
}

std::string card_link(std::size_t group) { return "#group-" + std::to_string(group); }

struct View {
  unsigned images = kLastImage;
  statistics::Rule rule = statistics::Rule::own;
};

// The limits of the classes, times a factor and with a unit, in words and colours.
void legend(PageWriter& out, const std::string& kind, const std::string& title, const std::array<double, 4>& limits,
            double factor, const std::string& unit) {
  Words words = title + " ";
  for (std::size_t i = 0; i <= limits.size(); ++i)
    words.add((i < limits.size() ? "at most " : "above ") +
                  shortest(rounded(factor * limits[std::min(i, limits.size() - 1)], 3)) + unit,
              "m" + std::to_string(i));
  out.text(words, kind);
}

// Of excess errors: in the unit of the score, or in multiples of its resolution where scenes have several.
void excess_legend(PageWriter& out, const PageModel& page) {
  const SceneScore score = common_score(page);
  const bool several =
      any_group(page, [&score](const Group& group) { return group.scored_by.resolution != score.resolution; });
  legend(out, "classes of-error", "Excess " + score.name + (several ? ", in steps of its resolution:" : ":"),
         kExcessClasses, (several ? 1 : score.resolution) / SceneScore().resolution, several ? "" : score.suffix());
}

std::string percent_text(double share) { return number_text(100 * share, 2) + " %"; }

Cell matrix_cell(const Group& group, const Row* row, const View& view) {
  if (!row) return {""};
  const Score* score = excess_after(*row, view.images, view.rule);
  if (!score || score->n == 0) {
    const std::string why =
        row->trials == 0 ? counted(row->failed, "trial") + " failed"
        : score          ? "not recorded for this rule"
                         : "only " + counted(row->excess.empty() ? 0 : row->excess.back().images, group.words.counted);
    return {row->trials == 0 ? "failed" : "-", std::nullopt, "quiet", why};
  }
  const double share = score->median / group.start_excess;
  const bool fewer = score->n < group.instances;
  std::string hint = score->interval.exists() ? interval_text(score->interval, 3, " to ") + " (95 % interval)"
                     : score->n > 1           ? interval_text({score->q25, score->q75}, 3, " to ") + " (quartiles)"
                                              : "no interval";
  hint += ", " + (fewer ? std::to_string(score->n) + " of " : "") + counted(group.instances, "instance");
  if (row->failed > 0) hint += ", " + counted(row->failed, "trial") + " failed";
  Cell cell = {excess_text(score->median, group.scored_by) + (fewer ? "*" : ""), std::nullopt,
               "a" + std::to_string(excess_class(score->median * SceneScore().resolution / group.scored_by.resolution,
                                                 kExcessClasses)),
               hint};
  if (!std::isfinite(share)) return cell;
  cell.kind += " b" + std::to_string(excess_class(share, kShareClasses));
  cell.words.add(" ").add(percent_text(share), "share");
  return cell;
}

Table matrix_table(const PageModel& page, const Matrix& matrix, const MatrixPart& part, const View& view) {
  const SceneWords words = common_words(page);
  const std::string after =
      view.images == kLastImage ? "the last " + words.counted : std::to_string(view.images) + " " + words.counts();
  Table table{"heat excess",
              (matrix.parts.size() > 1 ? "Protocol " + part.protocol + ", after " : "After ") + after + ", rule " +
                  statistics::rule_name(view.rule),
              {{"method", "", "", "name"}}};
  table.sortable = false;
  std::vector<Cell> start = {{"at the start", std::nullopt, "name"}};
  for (const std::size_t index : part.domains) {
    const Group& group = page.groups[index];
    table.heads.push_back({group.noise_level, matrix.scenes > 1 ? group.scene : "", "", "number", card_link(index)});
    start.push_back({number_text(group.start_excess, 3), std::nullopt, "number"});
  }
  table.add(std::move(start), "start");
  const bool blocks = part.rows.front().method->of_class != part.rows.back().method->of_class;
  const MatrixRow* before = nullptr;
  for (const MatrixRow& row : part.rows) {
    if (blocks && (!before || before->method->of_class != row.method->of_class))
      table.add_title(words.observed(class_title(row.method->of_class)), "class");
    before = &row;
    std::vector<Cell> cells = {method_cell(row.method->name, false, row.method->training_tag)};
    for (std::size_t domain = 0; domain < row.cells.size(); ++domain)
      cells.push_back(matrix_cell(page.groups[part.domains[domain]], row.cells[domain], view));
    table.add(std::move(cells));
  }
  return table;
}

std::string explanation(const PageModel& page, const Matrix& matrix) {
  const SceneWords words = common_words(page);
  std::string text =
      "Excess error: the noise-free " + common_score(page).label() +
      " above that of the instance's optimum, at the pose of the rule (own: "
      "recommended by the method; best: lowest measured error; current), median over the instances. " +
      (words.counted == "move" ? std::string("Move k is step k. ")
                               : "Image k is step k; the capture at the start, step 0, does not count. ");
  if (matrix.shares && matrix.scenes > 1)
    text +=
        std::string(common_score(page).squared ? "RMSE is in the brightness of each scene's images, so columns of "
                                                 "different lenses are not comparable in absolute terms"
                                               : "Scores of different scenes are not comparable in absolute terms") +
        ": by default colours show the share of the excess at the start that remains. ";
  text += "Tooltips show intervals; column heads link to the curves; matrix.csv in the results folder has all numbers.";
  if (any_row(page, &Row::failed)) text += " *: fewer instances, since failed trials do not count.";
  if (matrix.domains < page.groups.size())
    text += " Not shown: " + counted(page.groups.size() - matrix.domains, "group") + " without known optima.";
  return text;
}

}  // namespace

void matrix_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  const Matrix matrix = matrix_of(page);
  if (!has_matrix(matrix)) return;
  const SceneWords words = common_words(page);
  std::vector<unsigned> images = matrix.images;
  images.push_back(kLastImage);
  std::vector<statistics::Rule> rules = matrix.rules;
  bool reduced = false;
  if (matrix.cells * images.size() * rules.size() > kMaxMatrixCells) rules = {page.rule}, reduced = true;
  if (matrix.cells * images.size() * rules.size() > kMaxMatrixCells) images = {kLastImage};
  out.heading(2, "Excess error by scene and noise level").text(explanation(page, matrix), "quiet");
  if (reduced)
    out.text("This page is large; matrix.csv has the other rules" +
                 (images.size() == 1 ? " and numbers of " + words.counts() + "." : std::string(".")),
             "quiet");
  std::vector<std::string> counts, names, units = {common_score(page).name};
  for (const unsigned count : images) counts.push_back(images_text(matrix, count));
  for (const statistics::Rule rule : rules) names.emplace_back(statistics::rule_name(rule));
  if (matrix.shares) units.emplace_back("share of the start");
  const auto place = static_cast<std::size_t>(std::find(rules.begin(), rules.end(), page.rule) - rules.begin());
  out.open("matrix")
      .choice(words.counted == "move" ? "Moves" : "Images", "i", counts, counts.size() - 1)
      .choice("Rule", "r", names, place % rules.size())
      .choice("Colours", "u", units, matrix.shares && matrix.scenes > 1 ? 1 : 0);
  excess_legend(out, page);
  if (matrix.shares) legend(out, "classes of-share", "Share of the excess at the start:", kShareClasses, 100, " %");
  for (std::size_t i = 0; i < images.size(); ++i)
    for (std::size_t r = 0; r < rules.size(); ++r) {
      out.open("view v" + std::to_string(i) + std::to_string(r));
      for (const MatrixPart& part : matrix.parts) out.table(matrix_table(page, matrix, part, {images[i], rules[r]}));
      out.close();
    }
  out.close();
}

// Yields, or errors where the matrix of excess errors lacks a group. Each cell links to the card of its group.
void heat_section(PageWriter& out, const PageParts& parts) {
  const PageModel& page = parts.page;
  if (page.groups.size() < 2 || page.methods.size() < 2) return;
  const bool by_yield = any_row(page, &Row::yield);
  const Matrix matrix = matrix_of(page);
  if (!by_yield && has_matrix(matrix) && matrix.domains == page.groups.size()) return;
  Table table{"heat", "", {{"method", "", "", "name"}}};
  table.sortable = false;
  for (std::size_t i = 0; i < page.groups.size(); ++i)
    table.heads.push_back({page.groups[i].label, "", "", "number", card_link(i)});
  for (const Method& method : page.methods) {
    std::vector<Cell> cells = {method_cell(method.label, false, method.training_tag)};
    for (std::size_t i = 0; i < page.groups.size(); ++i) {
      const Group& group = page.groups[i];
      Cell& cell = cells.emplace_back(Cell{""});
      for (const Row& row : group.rows)
        if (row.method == method.name && group.protocol == method.protocol)
          cell = by_yield ? heat_yield(row) : heat_error(row, best_of(group));
      for (Word& word : cell.words)
        if (!word.text.empty()) word.link = card_link(i);
    }
    table.add(std::move(cells));
  }
  out.heading(2, "Methods by scene and noise level")
      .text(by_yield
                ? "Instances in specification, %. Strong colours: nearly all; faint: few. Tooltips show intervals; "
                  "cells link to the curves."
                : "Median error. Strong colours: within 10 % of the best of the column; faint: more than five times "
                  "the best. Tooltips show intervals; cells link to the curves.",
            "quiet")
      .table(table);
}

void levels_section(PageWriter& out, const PageParts& parts) {
  std::vector<Figure> figures = level_figures(parts.page);
  // The ranking shows a single level.
  std::erase_if(figures, [](const Figure& figure) { return figure.chart.x.categories.size() < 2; });
  if (figures.empty()) return;
  out.heading(2, "Yield and moves to specification").open("figures");
  for (Figure& figure : figures) {
    std::vector<ChartSeries>& series = figure.chart.series;  // in ranking order
    if (const std::size_t all = series.size(); all > kMaxLevelMethods) {
      series.resize(kMaxLevelMethods);
      figure.caption += " First " + std::to_string(kMaxLevelMethods) + " of " + std::to_string(all) +
                        " methods; the ranking lists all.";
    }
    figure.caption = figure.chart.title + ". " + figure.caption;
    out.chart(figure);
  }
  out.close();
}

}  // namespace relign::report
