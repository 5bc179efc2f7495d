#include "images/edge_fields.h"

#include <algorithm>
#include <cmath>

#include "base/median.h"

namespace relign::images {
namespace {

constexpr std::size_t kMinSide = 16;  // of a region, px

std::optional<Region> read_region(const JsonSource& source, ObjectReader& field, const char* key, std::size_t width,
                                  std::size_t height, std::vector<Problem>& problems) {
  if (!field.get(key)) return std::nullopt;
  ObjectReader reader(source, field.pointer_to(key), problems);
  const auto whole = [&](const char* name, std::size_t lowest, std::size_t highest) {
    if (!reader.has(name)) reader.complain_missing(name, "pixels");
    return static_cast<std::size_t>(reader.integer(name, static_cast<std::int64_t>(lowest),
                                                   static_cast<std::int64_t>(lowest),
                                                   static_cast<std::int64_t>(highest)));
  };
  Region region;
  region.x = whole("x", 0, width);
  region.y = whole("y", 0, height);
  region.width = whole("width", kMinSide, std::max(width, kMinSide));
  region.height = whole("height", kMinSide, std::max(height, kMinSide));
  if (region.x + region.width > width || region.y + region.height > height)
    reader.complain(
        "", "the region exceeds the image of " + std::to_string(width) + " x " + std::to_string(height) + " pixels");
  reader.reject_unknown();
  return region;
}

Json region_json(const Region& region) {
  return {{"x", region.x}, {"y", region.y}, {"width", region.width}, {"height", region.height}};
}

// A window of twice the mark's side, sampled coarsely: enough for the place of a region.
struct Window {
  const View& image;
  double left, top;  // of the first sample
  double pitch;      // px
  static constexpr int kSamples = 48;

  Window(const View& of, double x, double y, double side) : image(of), left(x - side), top(y - side) {
    pitch = 2 * side / (kSamples - 1);
  }
  double x(int column) const { return left + column * pitch; }
  double y(int row) const { return top + row * pitch; }
  double at(int column, int row) const {
    return image.at(static_cast<std::size_t>(x(column) + 0.5), static_cast<std::size_t>(y(row) + 0.5));
  }
  bool is_inside(const Region& read) const {
    return left >= static_cast<double>(read.x) && top >= static_cast<double>(read.y) &&
           x(kSamples - 1) <= static_cast<double>(read.x + read.width - 1) &&
           y(kSamples - 1) <= static_cast<double>(read.y + read.height - 1);
  }
  double border_level() const {
    std::vector<double> border;
    for (int k = 0; k < kSamples; ++k)
      for (const double value : {at(k, 0), at(k, kSamples - 1), at(0, k), at(kSamples - 1, k)}) border.push_back(value);
    return median(std::move(border));
  }
};

// The pixels of a field that are read out.
Region read_out(const View& image, const EdgeField& field) {
  return field.window.value_or(Region{0, 0, image.width, image.height});
}

// Moves (x, y) to the centroid of the mark's pixels, those beyond half of its contrast, until it rests there. False
// without a mark.
bool find_mark(const View& image, const Region& read, double side, double& x, double& y) {
  constexpr int kMoves = 8;
  constexpr double kRest_px = 0.05, kFaintest = 0.05;  // of the level
  for (int move = 0; move < kMoves; ++move) {
    const Window window(image, x, y, side);
    if (!window.is_inside(read)) return false;
    const double level = window.border_level();
    double sum = 0;
    for (int row = 0; row < Window::kSamples; ++row)
      for (int column = 0; column < Window::kSamples; ++column) sum += window.at(column, row) - level;
    const double contrast = sum * window.pitch * window.pitch / (side * side);  // as if all of it were the mark's
    if (!(std::fabs(contrast) > kFaintest * std::max(std::fabs(level), std::fabs(level + contrast)))) return false;
    double weight = 0, moment_x = 0, moment_y = 0;
    for (int row = 0; row < Window::kSamples; ++row)
      for (int column = 0; column < Window::kSamples; ++column) {
        const double excess = (window.at(column, row) - level) / contrast - 0.5;
        if (!(excess > 0)) continue;
        weight += excess;
        moment_x += excess * window.x(column);
        moment_y += excess * window.y(row);
      }
    if (!(weight > 0)) return false;
    const double to_x = moment_x / weight, to_y = moment_y / weight;
    const bool rests = std::fabs(to_x - x) < kRest_px && std::fabs(to_y - y) < kRest_px;
    x = to_x;
    y = to_y;
    if (rests) return true;
  }
  return true;
}

}  // namespace

EdgeFields read_edge_fields(const JsonSource& source, const std::string& pointer, std::size_t image_width,
                            std::size_t image_height, std::vector<Problem>& problems) {
  EdgeFields fields;
  const Json& list = source.root().at(Json::json_pointer(pointer));
  if (!list.is_array() || list.empty() || list.size() > kMaxFields) {
    problems.push_back(
        source.problem(pointer, "expected a list of 1 to " + std::to_string(kMaxFields) +
                                    R"( fields, each {"name": ..., "tangential": {...}, "sagittal": {...}})"));
    return fields;
  }
  for (std::size_t i = 0; i < list.size(); ++i) {
    ObjectReader reader(source, pointer + "/" + std::to_string(i), problems);
    EdgeField field;
    field.name = reader.required_string("name");
    if (reader.get("mark")) {
      ObjectReader mark(source, reader.pointer_to("mark"), problems);
      const auto width = static_cast<double>(image_width), height = static_cast<double>(image_height);
      Mark read;
      read.x_px = mark.required_number("x_px", 0, width);
      read.y_px = mark.required_number("y_px", 0, height);
      read.side_px = mark.required_number("side_px", static_cast<double>(kMinSide), std::max(width, height));
      mark.reject_unknown();
      field.mark = read;
    }
    field.tangential = read_region(source, reader, "tangential", image_width, image_height, problems);
    field.sagittal = read_region(source, reader, "sagittal", image_width, image_height, problems);
    field.window = read_region(source, reader, "window", image_width, image_height, problems);
    if (!field.tangential && !field.sagittal)
      reader.complain("", "expected a region 'tangential' or 'sagittal' with a slanted edge");
    if (reader.has("name") && field.name.empty()) reader.complain("name", "expected a name, found an empty string");
    for (const EdgeField& other : fields)
      if (other.name == field.name && !field.name.empty())
        reader.complain("name", "duplicate field '" + field.name + "'");
    reader.reject_unknown();
    fields.push_back(std::move(field));
  }
  return fields;
}

Json to_json(const EdgeFields& fields) {
  Json list = Json::array();
  for (const EdgeField& field : fields) {
    Json json = {{"name", field.name}};
    if (field.mark)
      json["mark"] = {{"x_px", field.mark->x_px}, {"y_px", field.mark->y_px}, {"side_px", field.mark->side_px}};
    if (field.tangential) json["tangential"] = region_json(*field.tangential);
    if (field.sagittal) json["sagittal"] = region_json(*field.sagittal);
    if (field.window) json["window"] = region_json(*field.window);
    list.push_back(std::move(json));
  }
  return list;
}

FieldEdges::FieldEdges(const View& image, const EdgeFields& fields) : image_(image), fields_(fields) {
  std::vector<double> shifts_x, shifts_y;
  for (const EdgeField& field : fields_) {
    Found found;
    if (field.mark) {
      double x = field.mark->x_px, y = field.mark->y_px;
      if (find_mark(image_, read_out(image_, field), field.mark->side_px, x, y)) {
        found = {x, y};
        shifts_x.push_back(x - field.mark->x_px);
        shifts_y.push_back(y - field.mark->y_px);
      }
    }
    found_.push_back(found);
  }
  if (shifts_x.empty()) return;
  shift_x_px_ = median(std::move(shifts_x));
  shift_y_px_ = median(std::move(shifts_y));
}

std::optional<Region> FieldEdges::moved(std::size_t field, Direction direction) const {
  const EdgeField& where = fields_.at(field);
  const std::optional<Region>& region = where.region(direction);
  if (!region || !where.mark) return region;
  const bool is_found = !std::isnan(found_[field].x_px);
  const double by_x = std::round(is_found ? found_[field].x_px - where.mark->x_px : shift_x_px_);
  const double by_y = std::round(is_found ? found_[field].y_px - where.mark->y_px : shift_y_px_);
  const Region read = read_out(image_, where);
  const auto clipped = [](std::size_t first, std::size_t size, double by, std::size_t start, std::size_t count,
                          std::size_t& from, std::size_t& length) {
    const double low = std::max(static_cast<double>(start), static_cast<double>(first) + by);
    const double high = std::min(static_cast<double>(start + count), static_cast<double>(first + size) + by);
    if (!(high - low >= static_cast<double>(kMinSide))) return false;
    from = static_cast<std::size_t>(low);
    length = static_cast<std::size_t>(high - low);
    return true;
  };
  Region at;
  if (!clipped(region->x, region->width, by_x, read.x, read.width, at.x, at.width) ||
      !clipped(region->y, region->height, by_y, read.y, read.height, at.y, at.height))
    return std::nullopt;
  return at;
}

double FieldEdges::mtf(std::size_t field, Direction direction, double cycles_per_pixel) const {
  const std::optional<Region> region = moved(field, direction);
  return region ? edge_mtf(image_, *region, cycles_per_pixel) : kNotMeasurable;
}

double FieldEdges::edge_energy() const {
  double energy = 0, level = 0;
  std::size_t pixels = 0;
  for (std::size_t field = 0; field < fields_.size(); ++field)
    for (const Direction direction : {Direction::tangential, Direction::sagittal}) {
      const std::optional<Region> region = moved(field, direction);
      if (!region) continue;
      for (std::size_t y = region->y + 1; y + 1 < region->y + region->height; ++y) {
        double row_energy = 0, row_level = 0;
        for (std::size_t x = region->x + 1; x + 1 < region->x + region->width; ++x) {
          const auto across = [&](std::size_t row) { return (image_.at(x + 1, row) - image_.at(x - 1, row)) / 2; };
          const auto down = [&](std::size_t column) {
            return (image_.at(column, y + 1) - image_.at(column, y - 1)) / 2;
          };
          row_energy += across(y) * across(y + 1) + down(x) * down(x + 1);
          row_level += image_.at(x, y);
        }
        energy += row_energy;
        level += row_level;
      }
      pixels += (region->width - 2) * (region->height - 2);
    }
  const double mean_level = level / static_cast<double>(std::max<std::size_t>(pixels, 1));
  return mean_level > 0 ? std::max(0.0, energy / static_cast<double>(pixels) / (mean_level * mean_level)) : 0;
}

}  // namespace relign::images
