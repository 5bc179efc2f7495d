#include "imaging/chart_fields.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "base/error.h"
#include "imaging/pupil_tiles.h"
#include "imaging/ray_bundle.h"
#include "imaging/target.h"
#include "optics/elementary.h"

namespace relign::imaging {
namespace {

constexpr double kSmallestSide_px = 40, kLargestRegion_px = 128;
// Of the square's side: from its middle almost to that of the gap, and without its corners.
constexpr double kAcross = 0.9, kAlong = 0.65;
constexpr double kOuter = 0.8, kInner = 0.45;  // of the way to sides and corners

struct Spot {
  double x = 0, y = 0;  // px, 0 = centre of the first column, of the top row
};

double distance_of(const Spot& a, const Spot& b) {
  return std::sqrt((a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y));
}

// Images of points of the emitter by the design.
class ChiefRays {
 public:
  explicit ChiefRays(const SceneFile& scene)
      : scene_(scene), design_(scene.lens), pose_(scene.axes(), 0.5), aim_(pupil_aim(scene)) {}
  std::optional<Spot> image_of(double x_mm, double y_mm) const {
    const RayBundle bundle(scene_, design_, pose_, {x_mm, y_mm}, aim_.z_mm);
    RayBundle::Light hit = bundle.at(0, 0, false);
    if (!(hit.weight > 0)) {
      const Window window = passing_window(bundle, aim_);
      if (!(window.low_u < window.high_u)) return std::nullopt;
      hit = bundle.at((window.low_u + window.high_u) / 2, (window.low_v + window.high_v) / 2, false);
      if (!(hit.weight > 0)) return std::nullopt;
    }
    const Sensor& sensor = scene_.sensor;
    return Spot{(hit.x_mm - sensor.left_mm) / sensor.pitch_mm - 0.5,
                (sensor.top_mm - hit.y_mm) / sensor.pitch_mm - 0.5};
  }

 private:
  const SceneFile& scene_;
  optics::Assembly design_;
  std::vector<double> pose_;
  PupilAim aim_;
};

// A square of the chart with its four edges; opposite ones are two apart.
struct Square {
  Spot centre;
  std::array<Spot, 4> edges;
  std::array<ChartEdge, 4> on_chart;
  double x_mm = 0, y_mm = 0;  // on the emitter
  double side(std::size_t edge) const { return distance_of(edges[edge], edges[(edge + 2) % 4]); }
};

std::vector<Square> squares_on(const SceneFile& scene, const SquareGrid& grid) {
  const ChiefRays rays(scene);
  const double spacing = scene.emitter.side_mm / grid.per_side, half = spacing / 4;
  const optics::SineCosine turn = optics::sine_cosine_of_degrees(grid.angle_deg);
  std::vector<Square> squares;
  for (int row = 0; row < grid.per_side; ++row)
    for (int column = 0; column < grid.per_side; ++column) {
      const double x = (column + 0.5) * spacing - scene.emitter.side_mm / 2;
      const double y = (row + 0.5) * spacing - scene.emitter.side_mm / 2;
      const auto centre = rays.image_of(x, y);
      if (!centre) continue;
      Square square{*centre, {}, {}, x, y};
      std::size_t seen = 0;
      for (double normal_x = turn.cosine, normal_y = turn.sine; seen < 4; ++seen) {
        square.on_chart[seen] = {x + half * normal_x, y + half * normal_y, normal_x, normal_y};
        const auto spot = rays.image_of(square.on_chart[seen].x_mm, square.on_chart[seen].y_mm);
        if (!spot) break;
        square.edges[seen] = *spot;
        normal_x = std::exchange(normal_y, normal_x) * -1;  // a quarter turn
      }
      if (seen == 4) squares.push_back(square);
    }
  return squares;
}

// The edge of each direction that is nearer to `middle`.
struct Chosen {
  std::size_t tangential = 0, sagittal = 1;
};

Chosen chosen_edges(const Square& square, const Spot& middle, double tie_px) {
  Spot radial{square.centre.x - middle.x, square.centre.y - middle.y};
  if (distance_of(square.centre, middle) < tie_px) radial = {1, 0};
  const auto along_radial = [&](std::size_t edge) {
    return std::fabs((square.edges[edge].x - square.edges[edge + 2].x) * radial.x +
                     (square.edges[edge].y - square.edges[edge + 2].y) * radial.y) /
           square.side(edge);
  };
  const auto nearer = [&](std::size_t edge) {
    return distance_of(square.edges[edge], middle) <= distance_of(square.edges[edge + 2], middle) ? edge : edge + 2;
  };
  const std::size_t pair = along_radial(0) >= along_radial(1) ? 0 : 1;
  return {nearer(pair), nearer(1 - pair)};
}

// Empty if it is not wholly on the sensor.
std::optional<images::Region> region_at(const SceneFile& scene, const Square& square, std::size_t edge) {
  const Spot &at = square.edges[edge], &opposite = square.edges[(edge + 2) % 4];
  double width = std::min(kLargestRegion_px, kAcross * square.side(edge));
  double height = std::min(kLargestRegion_px, kAlong * square.side((edge + 1) % 4));
  if (std::fabs(at.x - opposite.x) < std::fabs(at.y - opposite.y)) std::swap(width, height);
  const double left = std::round(at.x - width / 2), top = std::round(at.y - height / 2);
  if (!(left >= 0 && top >= 0 && left + width <= scene.sensor.width && top + height <= scene.sensor.height))
    return std::nullopt;
  return images::Region{static_cast<std::size_t>(left), static_cast<std::size_t>(top), static_cast<std::size_t>(width),
                        static_cast<std::size_t>(height)};
}

// The place that the fields' list gives.
Spot place_of(const images::EdgeField& field) {
  if (field.mark) return {field.mark->x_px, field.mark->y_px};
  const images::Region& region = field.tangential ? *field.tangential : *field.sagittal;
  return {static_cast<double>(region.x) + (static_cast<double>(region.width) - 1) / 2,
          static_cast<double>(region.y) + (static_cast<double>(region.height) - 1) / 2};
}

// The point of the emitter that the design images there: Newton's method from the middle of the emitter.
FieldPoint point_at(const SceneFile& scene, const ChiefRays& rays, const images::EdgeField& field) {
  constexpr int kMoves = 30;
  constexpr double kRest_px = 1e-3;
  const Spot wanted = place_of(field);
  const double small = scene.emitter.side_mm * 1e-4;
  double x = 0, y = 0;
  for (int move = 0; move < kMoves; ++move) {
    const auto here = rays.image_of(x, y), beside = rays.image_of(x + small, y), above = rays.image_of(x, y + small);
    if (!here || !beside || !above) break;
    const double to_x = wanted.x - here->x, to_y = wanted.y - here->y;
    if (std::fabs(to_x) < kRest_px && std::fabs(to_y) < kRest_px) {
      const double dx = x, dy = y, length = std::sqrt(dx * dx + dy * dy);
      return length > small ? FieldPoint{x, y, dx / length, dy / length} : FieldPoint{x, y, 1, 0};
    }
    const double a = (beside->x - here->x) / small, b = (above->x - here->x) / small;
    const double c = (beside->y - here->y) / small, d = (above->y - here->y) / small;
    const double determinant = a * d - b * c;
    x += (d * to_x - b * to_y) / determinant;
    y += (a * to_y - c * to_x) / determinant;
  }
  throw Error(
      ErrorKind::bad_input,
      "scene '" + scene.name + "': the design images no point of the target onto the field '" + field.name + "'");
}

double rounded(double px) { return std::round(10 * px) / 10; }

}  // namespace

std::vector<ChartField> chart_fields(const SceneFile& scene) {
  std::vector<ChartField> fields;
  const std::optional<SquareGrid> grid = square_grid(scene.emitter.target);
  if (!grid) return fields;
  const std::vector<Square> squares = squares_on(scene, *grid);
  std::vector<bool> used(squares.size(), false);
  const Spot middle{(scene.sensor.width - 1) / 2.0, (scene.sensor.height - 1) / 2.0};

  const auto add = [&](const std::string& name, double x, double y) {
    const Spot wanted{middle.x + x * scene.sensor.width / 2, middle.y + y * scene.sensor.height / 2};
    std::optional<ChartField> nearest;
    std::size_t which = 0;
    double distance = 0;
    for (std::size_t i = 0; i < squares.size(); ++i) {
      const Square& square = squares[i];
      const double away = distance_of(square.centre, wanted), side = square.side(0);
      if (used[i] || !(side >= kSmallestSide_px) || away > 2 * side || (nearest && away >= distance)) continue;
      const Chosen chosen = chosen_edges(square, middle, side / 2);
      const auto tangential = region_at(scene, square, chosen.tangential);
      const auto sagittal = region_at(scene, square, chosen.sagittal);
      if (!tangential || !sagittal) continue;
      const images::Mark mark{rounded(square.centre.x), rounded(square.centre.y),
                              rounded((square.side(0) + square.side(1)) / 2)};
      nearest = ChartField{{name, mark, tangential, sagittal},
                           square.x_mm,
                           square.y_mm,
                           square.on_chart[chosen.tangential],
                           square.on_chart[chosen.sagittal]};
      which = i;
      distance = away;
    }
    if (!nearest) return;
    used[which] = true;
    fields.push_back(std::move(*nearest));
  };

  add(images::kCentreField, 0, 0);
  add("left", -kOuter, 0);
  add("right", kOuter, 0);
  add("top", 0, -kOuter);
  add("bottom", 0, kOuter);
  for (const auto& [prefix, share] : {std::pair{"", kOuter}, std::pair{"inner ", kInner}})
    for (const char* row : {"top", "bottom"})
      for (const char* column : {"left", "right"})
        add(std::string(prefix) + row + " " + column, column == std::string("left") ? -share : share,
            row == std::string("top") ? -share : share);
  return fields;
}

images::EdgeFields fields_of(const SceneFile& scene) {
  if (!scene.fields.empty()) return scene.fields;
  images::EdgeFields fields;
  for (ChartField& field : chart_fields(scene)) fields.push_back(std::move(field.field));
  return fields;
}

constexpr double kWindowOfMark = 2.25;  // of its side

std::vector<PixelBox> windows_around_fields(const SceneFile& scene, int pixels) {
  const images::EdgeFields fields = fields_of(scene);
  if (fields.empty())
    throw Error(ErrorKind::bad_input, "scene '" + scene.name +
                                          "': windows need fields to be around: list 'fields' in the scene file, or "
                                          "choose target camera_chart or slanted_edges");
  const Sensor& sensor = scene.sensor;
  const int tile = tile_grid(sensor).tile_pixels;
  // Of one axis: first pixel and number of pixels.
  const auto snapped = [tile](double low, double high, int count) {
    const int first = std::max(0, static_cast<int>(std::floor(low)) / tile * tile);
    const int end = std::min(count, (static_cast<int>(std::ceil(high)) + tile - 1) / tile * tile);
    return std::pair{first, end - first};
  };
  std::vector<PixelBox> windows;
  for (const images::EdgeField& field : fields) {
    double low_x = sensor.width, high_x = 0, low_y = sensor.height, high_y = 0;
    const auto cover = [&](double left, double top, double width, double height) {
      low_x = std::min(low_x, left);
      high_x = std::max(high_x, left + width);
      low_y = std::min(low_y, top);
      high_y = std::max(high_y, top + height);
    };
    for (const auto& region : {field.tangential, field.sagittal})
      if (region)
        cover(static_cast<double>(region->x), static_cast<double>(region->y), static_cast<double>(region->width),
              static_cast<double>(region->height));
    const double middle_x = field.mark ? field.mark->x_px : (low_x + high_x) / 2;
    const double middle_y = field.mark ? field.mark->y_px : (low_y + high_y) / 2;
    // The search for a mark needs twice its side.
    const double side = std::max<double>(pixels, field.mark ? kWindowOfMark * field.mark->side_px : 0);
    cover(middle_x - side / 2, middle_y - side / 2, side, side);
    const auto [column, columns] = snapped(std::max(0.0, low_x), high_x, sensor.width);
    const auto [row, rows] = snapped(std::max(0.0, low_y), high_y, sensor.height);
    windows.push_back({column, row, columns, rows});
  }
  return windows;
}

std::vector<FieldPoint> points_of_fields(const SceneFile& scene) {
  std::vector<FieldPoint> points;
  if (scene.fields.empty()) {
    for (const ChartField& field : chart_fields(scene))
      points.push_back({field.x_mm, field.y_mm, field.tangential.normal_x, field.tangential.normal_y});
    return points;
  }
  const ChiefRays rays(scene);
  for (const images::EdgeField& field : scene.fields) points.push_back(point_at(scene, rays, field));
  return points;
}

}  // namespace relign::imaging
