// The generalisation matrix: the excess error of every method in every domain, a group with own optima, after some
// numbers of images and by each recommendation rule (docs/statistics.md).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "report/page_model.h"

namespace relign::report {

// Limits of the classes 0 to 4 of a cell: of the excess error (RMSE), and of its share of the group's excess at the
// start. The shares are the limits of the error for a start of 0.05.
inline constexpr std::array kExcessClasses = {0.0012, 0.002, 0.004, 0.01};
inline constexpr std::array kShareClasses = {0.025, 0.04, 0.08, 0.2};
int excess_class(double value, const std::array<double, 4>& limits);

struct MatrixRow {
  const Method* method = nullptr;
  std::vector<const Row*> cells;  // one per domain; nullptr: the method did not run there
};

// The domains and methods of one protocol.
struct MatrixPart {
  std::string protocol;
  std::vector<std::size_t> domains;  // indices into PageModel::groups: those with own optima
  std::vector<MatrixRow> rows;       // by class, then by the mean logarithm of the last excess by the page's rule
};

struct Matrix {
  std::vector<MatrixPart> parts;                 // in order of first appearance
  std::size_t domains = 0, rows = 0, cells = 0;  // of all parts
  std::size_t scenes = 0;                        // number of different ones
  bool shares = true;                            // every domain has an excess at the start
  std::vector<unsigned> images;            // common numbers of images, ascending; the last image follows as kLastImage
  unsigned least_last = 0, most_last = 0;  // budgets
  std::vector<statistics::Rule> rules;     // with values
};
inline constexpr unsigned kLastImage = 0;
Matrix matrix_of(const PageModel& page);
// Two domains and two methods or more, else there is nothing to compare.
inline bool has_matrix(const Matrix& matrix) { return matrix.domains > 1 && matrix.rows > 1; }

// The number of images as text: "6", "14 (last)", "last (6 to 14)".
std::string images_text(const Matrix& matrix, unsigned images);

// nullptr if the trials have fewer images. `images` may be kLastImage.
const Score* excess_after(const Row& row, unsigned images, statistics::Rule rule);

// Of an excess or an own optimum: "0.00123", "<0.0001" below the resolution of the score, "-" for NaN.
std::string excess_text(double excess, const SceneScore& score);

// matrix.csv: one row per method, group, rule and number of images. results/README.md describes the columns.
std::string matrix_csv(const PageModel& page);
// A table per protocol by the page's rule; "" without has_matrix().
std::string matrix_markdown(const PageModel& page);

}  // namespace relign::report
