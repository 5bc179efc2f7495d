#include "report/matrix_data.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/text.h"
#include "markup/escape.h"
#include "statistics/normalised_error.h"

namespace relign::report {
namespace {

// Methods that lack a domain come last. Differences below the resolution do not order.
double order_of(const MatrixRow& row, const std::vector<std::size_t>& domains, const PageModel& page,
                statistics::Rule rule) {
  double sum = 0;
  for (std::size_t i = 0; i < row.cells.size(); ++i) {
    const Row* cell = row.cells[i];
    const Score* score = cell ? excess_after(*cell, kLastImage, rule) : nullptr;
    if (!score || score->n == 0) return HUGE_VAL;
    sum += std::log(std::max(page.groups[domains[i]].scored_by.resolution, score->median));
  }
  return sum;
}

// "0.00300 / 0.00103": one number per number of images.
std::string markdown_cell(const Row* cell, const std::vector<unsigned>& images, statistics::Rule rule,
                          const SceneScore& scored_by) {
  if (!cell) return "";
  if (cell->trials == 0) return " failed";
  std::string text;
  for (const unsigned count : images) {
    const Score* score = excess_after(*cell, count, rule);
    text += (text.empty() ? " " : " / ") + (score ? excess_text(score->median, scored_by) : "-");
  }
  return text;
}

// The methods of the part's protocol.
void add_rows(MatrixPart& part, const PageModel& page) {
  for (const ObservationClass of_class : classes_in(page.methods)) {
    const auto first = static_cast<std::ptrdiff_t>(part.rows.size());
    for (const Method& method : page.methods) {
      if (method.of_class != of_class || method.protocol != part.protocol) continue;
      MatrixRow row = {&method, std::vector<const Row*>(part.domains.size(), nullptr)};
      bool any = false;
      for (std::size_t domain = 0; domain < part.domains.size(); ++domain)
        for (const Row& cell : page.groups[part.domains[domain]].rows)
          if (cell.method == method.name) row.cells[domain] = &cell, any = true;
      if (any) part.rows.push_back(std::move(row));
    }
    std::stable_sort(part.rows.begin() + first, part.rows.end(), [&](const MatrixRow& a, const MatrixRow& b) {
      return order_of(a, part.domains, page, page.rule) < order_of(b, part.domains, page, page.rule);
    });
  }
}

}  // namespace

int excess_class(double value, const std::array<double, 4>& limits) {
  if (std::isnan(value)) return -1;
  return static_cast<int>(std::count_if(limits.begin(), limits.end(), [&](double limit) { return value > limit; }));
}

const Score* excess_after(const Row& row, unsigned images, statistics::Rule rule) {
  for (const ExcessAfter& after : row.excess)
    if (images == kLastImage ? &after == &row.excess.back() : after.images == images) return &after.rules[rule];
  return nullptr;
}

Matrix matrix_of(const PageModel& page) {
  Matrix matrix;
  std::set<std::string> scenes;
  std::set<unsigned> images, last;
  std::set<statistics::Rule> rules;
  for (std::size_t index = 0; index < page.groups.size(); ++index) {
    const Group& group = page.groups[index];
    bool any = false;
    for (const Row& row : group.rows)
      for (const ExcessAfter& after : row.excess) {
        any = true;
        (&after == &row.excess.back() ? last : images).insert(after.images);
        for (const statistics::Rule rule : statistics::kRules)
          if (after.rules[rule].n > 0) rules.insert(rule);
      }
    if (!any) continue;
    auto part = std::find_if(matrix.parts.begin(), matrix.parts.end(),
                             [&](const MatrixPart& one) { return one.protocol == group.protocol; });
    if (part == matrix.parts.end()) part = matrix.parts.insert(part, {group.protocol, {}, {}});
    part->domains.push_back(index);
    ++matrix.domains;
    scenes.insert(group.scene);
    matrix.shares = matrix.shares && group.start_excess > 0;
  }
  matrix.scenes = scenes.size();
  matrix.images.assign(images.begin(), images.end());
  if (!last.empty()) matrix.least_last = *last.begin(), matrix.most_last = *last.rbegin();
  matrix.rules.assign(rules.begin(), rules.end());
  for (MatrixPart& part : matrix.parts) {
    add_rows(part, page);
    matrix.rows += part.rows.size();
    matrix.cells += part.rows.size() * part.domains.size();
  }
  return matrix;
}

std::string images_text(const Matrix& matrix, unsigned images) {
  if (images != kLastImage) return std::to_string(images);
  if (matrix.least_last == matrix.most_last) return std::to_string(matrix.most_last) + " (last)";
  return "last (" + std::to_string(matrix.least_last) + " to " + std::to_string(matrix.most_last) + ")";
}

std::string excess_text(double excess, const SceneScore& score) {
  return excess < score.resolution ? "<" + significant(score.resolution, 1) : number_text(excess, 3);
}

std::string matrix_csv(const PageModel& page) {
  std::string csv =
      "scene,noise_level,protocol,algorithm,class,oracle,rule,images,last,trials,failed,n,excess_median,excess_q25,"
      "excess_q75,excess_lo95,excess_hi95,start_excess_median,share_of_start\n";
  for (const Group& group : page.groups)
    for (const Row& row : group.rows)
      for (const ExcessAfter& after : row.excess)
        for (const statistics::Rule rule : statistics::kRules) {
          const Score& score = after.rules[rule];
          csv += csv_field(group.scene) + ',' + csv_field(group.noise_level) + ',' + csv_field(group.protocol) + ',' +
                 csv_field(row.method) + ',' + csv_field(class_name(row.of_class)) + ',' +
                 (row.oracle() ? "true" : "false") + ',' + statistics::rule_name(rule) + ',' +
                 std::to_string(after.images) + ',' + (&after == &row.excess.back() ? "true" : "false") + ',' +
                 std::to_string(row.trials) + ',' + std::to_string(row.failed) + ',' + std::to_string(score.n);
          for (const double value : {score.median, score.q25, score.q75, score.interval.low, score.interval.high,
                                     group.start_excess, shown(score.median / group.start_excess)})
            csv += ',' + sort_value(value);
          csv += '\n';
        }
  return csv;
}

std::string matrix_markdown(const PageModel& page) {
  const Matrix matrix = matrix_of(page);
  if (!has_matrix(matrix)) return "";
  std::vector<unsigned> images = matrix.images;
  images.push_back(kLastImage);
  std::string counts, out;
  for (const unsigned count : images) counts += (counts.empty() ? "" : " / ") + images_text(matrix, count);
  for (const MatrixPart& part : matrix.parts) {
    out += (out.empty() ? "" : "\n") + std::string("**Excess error by scene and noise level, protocol ") +
           markdown_text(part.protocol) + "**: " + common_score(page).label() +
           " above the instance's optimum, noise-free, by the rule " + statistics::rule_name(page.rule) +
           ", median after " + counts + " " + common_words(page).counts() +
           (common_words(page).counted == "move" ? "" : " (the capture at the start does not count)") +
           ".\n\n| method |";
    std::string rule = "|---|", start = "| at the start |";
    for (const std::size_t index : part.domains) {
      const Group& group = page.groups[index];
      out += " " + markdown_text((matrix.scenes > 1 ? group.scene + ", " : "") + group.noise_level) + " |";
      rule += "---|";
      start += " " + number_text(group.start_excess, 3) + " |";
    }
    out += "\n" + rule + "\n" + start + "\n";
    for (const MatrixRow& row : part.rows) {
      const Method& method = *row.method;
      out += "| " + markdown_text(method.name) + (method.of_class == ObservationClass::oracle ? " (oracle)" : "") +
             (method.training_tag.empty() ? "" : " (" + markdown_text(method.training_tag) + ")") + " |";
      for (std::size_t i = 0; i < row.cells.size(); ++i)
        out += markdown_cell(row.cells[i], images, page.rule, page.groups[part.domains[i]].scored_by) + " |";
      out += "\n";
    }
  }
  return out;
}

}  // namespace relign::report
