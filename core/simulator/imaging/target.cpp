#include "imaging/target.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/text.h"
#include "images/image_file.h"
#include "imaging/target_shapes.h"
#include "optics/elementary.h"

namespace relign::imaging {
namespace {

using Values = std::map<std::string, double>;

// A grid of fields with one shape in the centre of each, row by row.
template <class Shape>
void paint_grid(images::Image& bitmap, int per_side, const Shape& shape_at) {
  for (int row = 0; row < per_side; ++row)
    for (int column = 0; column < per_side; ++column)
      paint(bitmap, shape_at({(column + 0.5) / per_side, (row + 0.5) / per_side}));
}

// Alternating black and white fields, white in the upper left corner.
void paint_chessboard(images::Image& bitmap, int fields) {
  const double side = 1.0 / fields;
  for (int row = 0; row < fields; ++row)
    for (int column = row % 2; column < fields; column += 2)
      paint(bitmap, rectangle(column * side, row * side, side, side));
}

// Elements as those of USAF 1951: three vertical and three horizontal white bars of half a period, five half periods
// long, the next element smaller by the sixth root of 1/2. Packed in rows from the upper left, a period apart.
void paint_usaf_bars(images::Image& bitmap, int elements, double coarsest_period) {
  constexpr double kStep = 0.89089871814033930;
  constexpr double kLength = 2.5, kApart = 1;  // periods
  double period = coarsest_period, x = coarsest_period, y = coarsest_period, row_height = 0;
  for (int element = 0; element < elements; ++element, period *= kStep) {
    const double width = (2 * kLength + kApart) * period, height = kLength * period;
    if (x + width + kApart * period > 1) {
      x = coarsest_period;
      y += row_height + coarsest_period;
      row_height = 0;
    }
    if (y + height > 1 || x + width > 1)
      throw Error(ErrorKind::bad_input, "target 'usaf_bars': only " + std::to_string(element) + " of " +
                                            std::to_string(elements) + " elements fit with a first period of " +
                                            shortest(coarsest_period) + "; give fewer elements or a smaller period");
    for (int bar = 0; bar < 3; ++bar) {
      paint(bitmap, rectangle(x + bar * period, y, period / 2, height));
      paint(bitmap, rectangle(x + (kLength + kApart) * period, y + bar * period, height, period / 2));
    }
    x += width + 2 * kApart * period;
    row_height = std::max(row_height, height);
  }
}

// Upright crosses where four fields of the grid meet, in three rectangles each: shapes do not overlap.
void paint_crosses(images::Image& bitmap, int per_side) {
  const double arm = 0.13 / per_side, thick = 0.03 / per_side;
  for (int row = 1; row < per_side; ++row)
    for (int column = 1; column < per_side; ++column) {
      const double x = static_cast<double>(column) / per_side, y = static_cast<double>(row) / per_side;
      paint(bitmap, rectangle(x - arm, y - thick / 2, 2 * arm, thick));
      paint(bitmap, rectangle(x - thick / 2, y - arm, thick, arm - thick / 2));
      paint(bitmap, rectangle(x - thick / 2, y + thick / 2, thick, arm - thick / 2));
    }
}

images::Image draw(const std::string& name, const Values& values, int texels) {
  const auto whole = [&](const char* parameter) { return static_cast<int>(values.at(parameter)); };
  if (name == "siemens_star") return siemens_star(texels, whole("sectors"));
  const auto size = static_cast<std::size_t>(texels);
  images::Image bitmap(size, size);
  bool negative = false;
  if (name == "chessboard") {
    paint_chessboard(bitmap, whole("fields"));
  } else if (name == "slanted_edges" || name == "camera_chart") {
    const int squares = whole("squares");
    if (name == "camera_chart") paint_crosses(bitmap, squares);
    paint_grid(bitmap, squares,
               [&](const Place& centre) { return turned_square(centre, 0.5 / squares, values.at("angle_deg")); });
    negative = true;
  } else if (name == "usaf_bars") {
    paint_usaf_bars(bitmap, whole("elements"), values.at("period"));
  } else if (name == "point_grid") {
    const int points = whole("points");
    paint_grid(bitmap, points, [&](const Place& centre) { return disc(centre, values.at("diameter") / points); });
  } else {
    negative = true;  // white
  }
  // The steps of 8-bit image files: look-ups of such bitmaps are fast.
  constexpr float kSteps = 255;
  for (float& value : bitmap.values) {
    const float steps = std::round(std::clamp(value, 0.0F, 1.0F) * kSteps);
    value = (negative ? kSteps - steps : steps) / kSteps;
  }
  return bitmap;
}

std::string allowed_targets() {
  std::vector<std::string> names;
  for (const TargetKind& kind : target_kinds()) names.push_back(kind.name);
  return join(names, ", ") + ", or the path of an image file";
}

// "key=value,key=value" over the presets.
Values read_values(const TargetKind& kind, const std::string& text) {
  Values values;
  std::vector<std::string> names;
  for (const TargetParameter& parameter : kind.parameters) {
    values[parameter.name] = parameter.preset;
    names.push_back(parameter.name);
  }
  const std::string of_target = " of target '" + kind.name + "'";
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find(',', from), text.size());
    const std::string part = text.substr(from, end - from);
    from = end + 1;
    const std::size_t equals = std::min(part.find('='), part.size());
    const std::string name = part.substr(0, equals);
    const auto parameter = std::find_if(
        kind.parameters.begin(), kind.parameters.end(),
        [&](const TargetParameter& candidate) { return normalised_name(candidate.name) == normalised_name(name); });
    if (parameter == kind.parameters.end())
      throw Error(ErrorKind::bad_input, "unknown parameter '" + name + "'" + of_target +
                                            (names.empty() ? "; it has none" : suggestion(name, names)));
    const std::string number = equals < part.size() ? part.substr(equals + 1) : "";
    double value = 0;
    const auto read = std::from_chars(number.data(), number.data() + number.size(), value);
    const bool is_number = read.ec == std::errc() && read.ptr == number.data() + number.size();
    if (!is_number || !(value >= parameter->lowest && value <= parameter->highest) ||
        (parameter->whole && value != std::floor(value)))
      throw Error(ErrorKind::bad_input, "'" + part + "'" + of_target + ": " + parameter->name + " must be " +
                                            (parameter->whole ? "an integer" : "a number") + " from " +
                                            shortest(parameter->lowest) + " to " + shortest(parameter->highest) +
                                            ", such as " + parameter->name + "=" + shortest(parameter->preset));
    values[parameter->name] = value;
  }
  return values;
}

}  // namespace

const std::vector<TargetKind>& target_kinds() {
  static const std::vector<TargetKind> kinds = {
      {"siemens_star",
       "white and black sectors around the centre, as in the paper",
       {{"sectors", 18, 2, 180, true, "number of white sectors, with as many black ones between"}}},
      {"chessboard",
       "alternating black and white fields, white in the upper left corner",
       {{"fields", 12, 2, 256, true, "per side"}}},
      {"slanted_edges",
       "a grid of black squares on white, slightly rotated",
       {{"squares", 7, 1, 64, true, "per side, each half as wide as the grid spacing"},
        {"angle_deg", 5, -45, 45, false, "clockwise"}}},
      {"camera_chart",
       "slanted_edges with upright crosses between the squares, as on charts of camera lines",
       {{"squares", 9, 2, 64, true, "per side, each half as wide as the grid spacing"},
        {"angle_deg", 5, -45, 45, false, "clockwise"}}},
      {"usaf_bars",
       "groups of three vertical and three horizontal white bars, each smaller by the sixth root of 1/2",
       {{"elements", 24, 1, 48, true, "number of groups"},
        {"period", 0.06, 0.001, 0.15, false, "of the coarsest bars, as a fraction of the target's side"}}},
      {"point_grid",
       "small white discs on black",
       {{"points", 15, 1, 256, true, "per side"}, {"diameter", 0.1, 0.001, 1, false, "as a fraction of the spacing"}}},
      {"white", "white everywhere", {}},
  };
  return kinds;
}

std::optional<images::Image> draw_target(const std::string& text, int texels) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string name = text.substr(0, colon);
  std::vector<std::string> names;
  for (const TargetKind& kind : target_kinds()) {
    names.push_back(kind.name);
    if (normalised_name(kind.name) != normalised_name(name)) continue;
    return draw(kind.name, read_values(kind, text.substr(std::min(colon + 1, text.size()))), texels);
  }
  // Paths have a slash, or a dot before the parameters; names have neither.
  if (text.find_first_of("/\\") != std::string::npos || name.find('.') != std::string::npos) return std::nullopt;
  const std::string nearest = nearest_name(name, names);
  throw Error(ErrorKind::bad_input, "unknown target '" + text + "'" + "; allowed: " + allowed_targets() +
                                        (nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
}

std::optional<SquareGrid> square_grid(const std::string& text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  for (const TargetKind& kind : target_kinds()) {
    if (normalised_name(kind.name) != normalised_name(text.substr(0, colon))) continue;
    if (kind.name != "slanted_edges" && kind.name != "camera_chart") return std::nullopt;
    const Values values = read_values(kind, text.substr(std::min(colon + 1, text.size())));
    return SquareGrid{static_cast<int>(values.at("squares")), values.at("angle_deg")};
  }
  return std::nullopt;
}

images::Image siemens_star(int texels, int sectors) {
  // A point is white if it is between the two edges of a white sector: left of the first and right of the second, by
  // cross products (sectors are narrower than a half turn).
  std::vector<optics::SineCosine> edges;
  for (int k = 0; k <= 2 * sectors; ++k) edges.push_back(optics::sine_cosine_of_degrees(180.0 * k / sectors));
  const auto size = static_cast<std::size_t>(texels);
  images::Image star(size, size);
  for (int row = 0; row < texels; ++row)
    for (int column = 0; column < texels; ++column) {
      const double x = column + 0.5 - 0.5 * texels;
      const double y = 0.5 * texels - (row + 0.5);
      for (int k = 0; k < 2 * sectors; k += 2) {
        const optics::SineCosine &from = edges[static_cast<std::size_t>(k)],
                                 &to = edges[static_cast<std::size_t>(k + 1)];
        if (from.cosine * y - from.sine * x >= 0 && x * to.sine - y * to.cosine > 0) {
          star.at(static_cast<std::size_t>(column), static_cast<std::size_t>(row)) = 1;
          break;
        }
      }
    }
  return star;
}

images::Image target_from_file(const std::filesystem::path& file) {
  constexpr std::size_t kMaxTexels = 8192;
  const images::Image image = images::read_image(file);
  const std::size_t side = std::max({image.width, image.height, std::size_t{2}});
  if (side > kMaxTexels)
    throw Error(ErrorKind::bad_input, file.string() + ": the target has " + std::to_string(image.width) + " x " +
                                          std::to_string(image.height) + " texels; allowed are up to " +
                                          std::to_string(kMaxTexels) + " a side; scale it down");
  images::Image square(side, side);
  const std::size_t left = (side - image.width) / 2, top = (side - image.height) / 2;
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) square.at(left + x, top + y) = std::clamp(image.at(x, y), 0.0F, 1.0F);
  return square;
}

}  // namespace relign::imaging
