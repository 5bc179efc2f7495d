// MTF by field: places of a capture where its target shows slanted edges, found again in every capture and measured as
// on camera lines.
//
// A field has a region of interest with an edge for one or both directions. If its target has a mark there, a dark
// square on white or the reverse, the regions follow it: lenses that are still decentred move the image by more than
// the margin around an edge.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "images/measures.h"

namespace relign::images {

// A square mark as the reference shows it.
struct Mark {
  double x_px = 0, y_px = 0;  // its centre; 0 = centre of the first column, of the top row
  double side_px = 0;
};

// For spatial frequencies near the radial direction (tangential lines) and across it (sagittal lines).
enum class Direction { tangential, sagittal };

struct EdgeField {
  std::string name;  // "centre", or any other
  std::optional<Mark> mark;
  std::optional<Region> tangential, sagittal;  // one at least; as the reference shows them
  std::optional<Region> window = {};           // of a sensor that reads out windows only: nothing is known outside it
  const std::optional<Region>& region(Direction direction) const {
    return direction == Direction::tangential ? tangential : sagittal;
  }
};
using EdgeFields = std::vector<EdgeField>;

inline constexpr std::size_t kMaxFields = 64;
inline constexpr const char* kCentreField = "centre";

// [{"name", "mark": {"x_px", "y_px", "side_px"}, "tangential": {"x", "y", "width", "height"}, "sagittal": {...},
// "window": {...}}].
// Adds mistakes to `problems`: regions must be inside the image. `pointer` names an existing member.
EdgeFields read_edge_fields(const JsonSource& source, const std::string& pointer, std::size_t image_width,
                            std::size_t image_height, std::vector<Problem>& problems);
Json to_json(const EdgeFields& fields);

// The fields of one capture. `image` and `fields` must outlive it.
class FieldEdges {
 public:
  FieldEdges(const View& image, const EdgeFields& fields);

  // The mark's centre in this image: NaN without a mark, or if twice its side around it is not wholly in the image or
  // in the field's window.
  double mark_x_px(std::size_t field) const { return found_.at(field).x_px; }
  double mark_y_px(std::size_t field) const { return found_.at(field).y_px; }

  // As edge_mtf, pixel included. NaN without such an edge. A mark that is partly outside the image moves as the median
  // of the others; what is left of its region inside the image is measured.
  double mtf(std::size_t field, Direction direction, double cycles_per_pixel) const;

  // Mean squared gradient over the regions of all fields / squared mean level there (central differences, 1 / px^2).
  // A square is the product with the neighbour beside the difference, so that noise of single pixels averages out. At
  // least 0; 0 without light.
  double edge_energy() const;

 private:
  struct Found {
    double x_px = kNotMeasurable, y_px = kNotMeasurable;
  };
  // Empty: outside the image.
  std::optional<Region> moved(std::size_t field, Direction direction) const;

  View image_;
  const EdgeFields& fields_;
  std::vector<Found> found_;
  double shift_x_px_ = 0, shift_y_px_ = 0;  // median over the marks that were found
};

}  // namespace relign::images
