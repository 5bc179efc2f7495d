// relign/basics.hpp: poses, boxes, images and parameters, as every kind of plugin meets them. Comes with
// relign/plugin.hpp.
#ifndef RELIGN_BASICS_HPP
#define RELIGN_BASICS_HPP

#include <relign/plugin.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace relign {

inline relign_text to_text(std::string_view view) { return {view.data(), view.size()}; }
inline std::string_view to_view(relign_text text) { return {text.data, static_cast<std::size_t>(text.size)}; }

// Thrown by services that work for long (prior, model) once the user stopped the run. Let it pass: it ends run and is
// no failure. Not a std::exception, so that code that handles failures does not continue by mistake.
class Stopped {};

// Coordinates of the stage, one per axis, as shares of the travel.
using Pose = std::vector<double>;

// Axis-aligned box in commanded coordinates.
struct Box {
  Pose lower;
  Pose upper;

  Pose clamp(Pose pose) const {
    for (std::size_t axis = 0; axis < pose.size(); ++axis)
      pose[axis] = std::clamp(pose[axis], lower[axis], upper[axis]);
    return pose;
  }
  Pose centre() const {
    Pose middle(lower.size());
    for (std::size_t axis = 0; axis < middle.size(); ++axis) middle[axis] = 0.5 * (lower[axis] + upper[axis]);
    return middle;
  }
};

// Grey image: float32, row 0 on top. A view: valid as long as what it came from.
class ImageView {
 public:
  // Member by member: the host's struct may be older, and shorter, than this header's.
  explicit ImageView(const relign_image& image)
      : pixels_(image.pixels), row_stride_bytes_(image.row_stride_bytes), width_(image.width), height_(image.height) {}
  std::size_t width() const { return width_; }
  std::size_t height() const { return height_; }
  const float* row(std::size_t y) const {
    return reinterpret_cast<const float*>(reinterpret_cast<const char*>(pixels_) + y * row_stride_bytes_);
  }
  float at(std::size_t x, std::size_t y) const { return row(y)[x]; }
  // Without the last row, which begins with the readings where a scene has both.
  ImageView without_last_row() const {
    ImageView image = *this;
    --image.height_;
    return image;
  }

 private:
  const float* pixels_;
  std::uint64_t row_stride_bytes_;
  std::size_t width_;
  std::size_t height_;
};

// A rectangle of an image's pixels.
struct Region {
  std::uint32_t column = 0, row = 0;
  std::uint32_t columns = 0, rows = 0;
};

// The effective parameters: defaults, then preset, then the user's, already checked by the host.
class Parameters {
 public:
  Parameters(const relign_host* host, const relign_parameters* given) : host_(host), given_(given) {}

  double number(std::string_view name) const {
    double value = 0;
    check(given_->number(given_->context, to_text(name), &value), name, "number");
    return value;
  }
  std::int64_t integer(std::string_view name) const {
    std::int64_t value = 0;
    check(given_->integer(given_->context, to_text(name), &value), name, "integer");
    return value;
  }
  bool boolean(std::string_view name) const {
    std::int32_t value = 0;
    check(given_->boolean(given_->context, to_text(name), &value), name, "boolean");
    return value != 0;
  }
  std::string text(std::string_view name) const {
    relign_text value{nullptr, 0};
    check(given_->text(given_->context, to_text(name), &value), name, "text");
    return std::string(to_view(value));
  }
  // All parameters as one JSON object, for plugins that bring a JSON library.
  std::string json() const { return std::string(to_view(given_->json)); }

  // Where the plugin's manifest and data files lie; where it may cache (empty: nowhere).
  std::string plugin_folder() const { return std::string(to_view(host_->plugin_folder)); }
  std::string cache_folder() const { return std::string(to_view(host_->cache_folder)); }
  // Threads this object may use for its own work.
  unsigned threads() const { return host_->threads; }
  void warn(std::string_view message) const { host_->log(host_->context, RELIGN_LOG_WARNING, to_text(message)); }

 private:
  static void check(relign_status status, std::string_view name, const char* type) {
    if (status != RELIGN_OK)
      throw std::invalid_argument("the manifest declares no parameter '" + std::string(name) + "' of type " + type);
  }
  const relign_host* host_;
  const relign_parameters* given_;
};

}  // namespace relign

#endif  // RELIGN_BASICS_HPP
