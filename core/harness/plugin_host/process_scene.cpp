// Scenes that run as processes: simulators and stations (docs/process_plugins.md has the messages). Pixels pass through
// the memory file of the process, which is emptied before each request for an image and read, never mapped, afterwards:
// a process that writes too little or truncates the file causes an error and does not kill the host.
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <functional>
#include <optional>
#include <set>

#include "plugin_host/process_child.h"
#include "plugin_host/process_plugin.h"
#include "plugin_host/scene_backend.h"

namespace relign::plugin_host {
namespace {

std::string request(const char* name) { return "{\"message\":\"" + std::string(name) + "\""; }

// The process of one scene, and the image that it writes.
class SceneProcess {
 public:
  SceneProcess(const Choice& choice, const HostServices& services) : plugin_(choice, services) {
    const Json asked = {{"message", "describe"}, {"image_file", ChildProcess::pixel_path()}};
    const Json described = plugin_.ask(asked, "described", "describe");
    description_ = plugin_.object(described, "description", "describe");
    if (const auto listed = described.find("abilities"); listed != described.end() && listed->is_array())
      for (const Json& name : *listed)
        if (name.is_string()) abilities_.insert(name.get<std::string>());
    width_ = side("width");
    height_ = side("height");
  }

  ProcessPlugin& plugin() { return plugin_; }
  const Json& description() const { return description_; }
  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  std::size_t pixels() const { return std::size_t{width_} * height_; }

  const char* judge() const { return description_.contains("score") ? "score" : "noise_free_mse"; }

  bool offers(std::string_view ability) const { return abilities_.count(ability) > 0; }

  // Requests images, which follow one another. `line` is without its newline and closing brace.
  Json ask_for_image(std::string line, const char* answer, const char* during, float* pixels,
                     const char* otherwise = nullptr, std::size_t images = 1) {
    if (::ftruncate(plugin_.pixel_file(), 0) != 0) errno = 0;  // of a process that has ended, which ask reports
    Json answered = plugin_.ask_line(line + "}\n", answer, during, otherwise);
    if (answered["message"] == answer) take_pixels(during, pixels, images);
    return answered;
  }

 private:
  // Of a capture, in which readings are a line. 0 when the description has none, which trials/scene_facts.h reports
  // together with other mistakes.
  std::uint32_t side(const std::string& name) const {
    constexpr double kMaxSide = 20000;  // pixels
    const auto readings = description_.find("readings");
    const bool reads = readings != description_.end() && readings->is_array();
    const std::uint32_t line = reads && name == "height" ? 1 : 0;
    const auto image = description_.find("image");
    if (image == description_.end() && reads)
      return name == "height" ? line : static_cast<std::uint32_t>(std::min<std::size_t>(readings->size(), kMaxSide));
    if (image == description_.end() || !image->is_object()) return 0;
    const auto found = image->find(name);
    if (found == image->end() || !found->is_number()) return 0;
    const double value = found->get<double>();
    return value >= 1 && value <= kMaxSide && value == std::floor(value) ? static_cast<std::uint32_t>(value) + line : 0;
  }

  void take_pixels(const char* during, float* pixels, std::size_t images) {
    struct stat file {};
    const std::size_t wanted = this->pixels() * images * sizeof(float);
    const bool known = ::fstat(plugin_.pixel_file(), &file) == 0;
    const auto found = known ? static_cast<std::size_t>(file.st_size) : 0;
    if (found != wanted)
      plugin_.fail(during, "its image file has " + std::to_string(found) + " bytes; expected " +
                               std::to_string(wanted) + ": " + std::to_string(height_ * images) + " rows of " +
                               std::to_string(width_) + " float32 values");
    auto* place = reinterpret_cast<char*>(pixels);
    std::size_t read = 0;
    while (read < wanted) {
      const ssize_t got = ::pread(plugin_.pixel_file(), place + read, wanted - read, static_cast<off_t>(read));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) plugin_.fail(during, "its image file became shorter while it was read");
      read += static_cast<std::size_t>(got);
    }
  }

  ProcessPlugin plugin_;
  Json description_;
  std::set<std::string, std::less<>> abilities_;  // that it understands requests for
  std::uint32_t width_ = 0;
  std::uint32_t height_ = 0;
};

class ProcessAssembly final : public AssemblyBackend {
 public:
  ProcessAssembly(SceneProcess& scene, std::uint64_t number, const std::string& offsets_json)
      : scene_(scene), number_(number) {
    scene_.plugin().ask(Json{{"message", "mount"}, {"assembly", number_}, {"offsets", parsed_json(offsets_json)}}, "ok",
                        "mount");
  }
  ~ProcessAssembly() override {
    try {
      scene_.plugin().ask_line(about_this("unmount") + "}\n", "ok", "unmount");
    } catch (...) {  // the scene's next request reports it
    }
  }

  void capture(const std::vector<double>& true_pose, std::uint64_t frame_seed, float* pixels) override {
    scene_.ask_for_image(about_pose("capture", true_pose) + ",\"seed\":" + std::to_string(frame_seed), "ok", "capture",
                         pixels);
  }

  MountedAssembly::Truth noise_free_mse(const std::vector<double>& true_pose, std::uint64_t seed) override {
    const char* what = scene_.judge();
    const Json answer = scene_.plugin().ask_line(
        about_pose("noise_free_mse", true_pose) + ",\"seed\":" + std::to_string(seed) + "}\n", "measured", what);
    return {scene_.plugin().number(answer, "mse", what), scene_.plugin().number(answer, "standard_error", what)};
  }

#include "process_abilities.inc"

 private:
  std::string about_this(const char* name) const { return request(name) + ",\"assembly\":" + std::to_string(number_); }
  std::string about_pose(const char* name, const std::vector<double>& true_pose) const {
    std::string line = about_this(name) + ",\"pose\":";
    append_numbers(line, true_pose.data(), true_pose.size());
    return line;
  }

  // A request for an ability, without its closing brace.
  struct Request {
    const char* ability;
    std::string line;

    void add(const char* name, double value) { append_number(member(name), value); }
    void add(const char* name, std::uint64_t value) { member(name) += std::to_string(value); }
    void add(const char* name, std::uint32_t value) { member(name) += std::to_string(value); }
    void add(const char* name, const Pose& values) { append_numbers(member(name), values.data(), values.size()); }
    void add(const char* name, const std::vector<std::uint32_t>& values) { member(name) += Json(values).dump(); }
    void add(const char* name, const std::vector<Region>& regions) {
      Json list = Json::array();
      for (const Region& region : regions) list.push_back({region.column, region.row, region.columns, region.rows});
      member(name) += list.dump();
    }
    std::string& member(const char* name) { return line += ",\"" + std::string(name) + "\":"; }
  };
  Request about(const char* ability) const {
    return {ability, about_this("ability") + ",\"ability\":\"" + ability + "\""};
  }
  // Nothing when the scene does not offer it.
  std::optional<Json> ask(const Request& request, float* pixels = nullptr, std::size_t images = 0) {
    if (!scene_.offers(request.ability)) return std::nullopt;
    Json answer = images > 0
                      ? scene_.ask_for_image(request.line, "result", request.ability, pixels, "unsupported", images)
                      : scene_.plugin().ask_line(request.line + "}\n", "result", request.ability, "unsupported");
    if (answer["message"] != "result") return std::nullopt;
    return answer;
  }
  void take(const Json& answer, const char* ability, const char* name, double& value) {
    value = scene_.plugin().number(answer, name, ability);
  }
  void take(const Json& answer, const char* ability, const char* name, std::uint64_t& value) {
    value = scene_.plugin().bits(answer, name, ability);
  }
  void take(const Json& answer, const char* ability, const char* name, std::vector<double>& values, std::size_t count) {
    values = scene_.plugin().numbers(answer, name, ability);
    if (values.size() != count)
      scene_.plugin().fail(ability, "'" + std::string(name) + "' has " + std::to_string(values.size()) +
                                        " values; expected " + std::to_string(count));
  }
  std::size_t axes() const {
    const auto axes = scene_.description().find("axes");
    return axes == scene_.description().end() ? 0 : axes->size();
  }

  SceneProcess& scene_;
  std::uint64_t number_;
};

class ProcessScene final : public SceneBackend {
 public:
  ProcessScene(const Choice& choice, const HostServices& services) : scene_(choice, services) {}

  // Requested once, because the size of images must not change.
  std::string describe() override { return scene_.description().dump(); }

  relign_image reference() override {
    if (reference_.empty()) {
      if (scene_.pixels() == 0) refuse("reference", "its description has no image size");
      std::vector<float> pixels(scene_.pixels());
      scene_.ask_for_image(request("reference"), "ok", "reference", pixels.data());
      reference_ = std::move(pixels);
    }
    relign_image image{};
    image.struct_size = sizeof image;
    image.sample_format = RELIGN_SAMPLE_FLOAT32;
    image.width = scene_.width();
    image.height = scene_.height();
    image.channels = 1;
    image.pixels = reference_.data();
    image.row_stride_bytes = std::uint64_t{image.width} * sizeof(float);
    return image;
  }

  std::unique_ptr<AssemblyBackend> mount(const std::string& offsets_json) override {
    return std::make_unique<ProcessAssembly>(scene_, ++mounted_, offsets_json);
  }

  const char* judge() const override { return scene_.judge(); }

  bool offers(std::string_view ability) override { return scene_.offers(ability); }

  bool offers_stage() const override {
    const auto owns = scene_.description().find("owns_stage");
    return owns != scene_.description().end() && *owns == true;
  }

  void begin(std::uint64_t seed) override {
    scene_.plugin().ask_line(request("begin") + ",\"seed\":" + std::to_string(seed) + "}\n", "ok", "begin");
  }

  Scene::StageMove move_by(const std::vector<double>& delta) override {
    const char* what = "move_by";
    std::string line = request(what) + ",\"delta\":";
    append_numbers(line, delta.data(), delta.size());
    ProcessPlugin& plugin = scene_.plugin();
    const Json answer = plugin.ask_line(line + "}\n", "moved", what);
    Scene::StageMove made;
    made.moved = plugin.numbers(answer, "moved", what);
    if (made.moved.size() != delta.size())
      refuse(what, "it moved " + std::to_string(made.moved.size()) + " axes; expected " + std::to_string(delta.size()));
    made.limits_low = plugin.bits(answer, "limits_low", what);
    made.limits_high = plugin.bits(answer, "limits_high", what);
    made.machine_seconds = plugin.number(answer, "machine_seconds", what);
    return made;
  }

  double capture(float* pixels) override {
    const Json answer = scene_.ask_for_image(request("capture"), "captured", "capture", pixels);
    return scene_.plugin().number(answer, "machine_seconds", "capture");
  }

  [[noreturn]] void refuse(const char* what, const std::string& message) override {
    scene_.plugin().fail(what, message);
  }

 private:
  SceneProcess scene_;
  std::vector<float> reference_;
  std::uint64_t mounted_ = 0;  // number of the latest assembly
};

}  // namespace

std::unique_ptr<SceneBackend> make_process_scene(const Choice& choice, const HostServices& services) {
  return std::make_unique<ProcessScene>(choice, services);
}

}  // namespace relign::plugin_host
