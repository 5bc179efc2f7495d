// relign/plugin.hpp: write a plugin in C++17.
//
// Derive from Optimizer, Agent, NoiseLevel, Scene or Station, give the class a constructor from
// `const Parameters&`, and end the file with RELIGN_PLUGIN(YourClass). Build it with
// relign_add_plugin(name file.cpp) beside a relign-plugin.json. Everything here is inline;
// nothing but plugin.h and the standard library is included.
//
// Errors: throw std::exception (or anything) from any member; the wrapper turns it into a
// failure with its text. Nothing is thrown across the library's border.
#ifndef RELIGN_PLUGIN_HPP
#define RELIGN_PLUGIN_HPP

#include <relign/plugin.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <optional>
#include <relign/random.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace relign {

inline relign_text to_text(std::string_view view) { return {view.data(), view.size()}; }
inline std::string_view to_view(relign_text text) { return {text.data, static_cast<std::size_t>(text.size)}; }

// Thrown by services that work for long (prior, model) once the user stopped the run. Let it pass: it ends run and is
// no failure. Not a std::exception, so that whoever handles failures does not go on by mistake.
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
  explicit ImageView(const relign_image& image) : image_(image) {}
  std::size_t width() const { return image_.width; }
  std::size_t height() const { return image_.height; }
  const float* row(std::size_t y) const {
    return reinterpret_cast<const float*>(reinterpret_cast<const char*>(image_.pixels) + y * image_.row_stride_bytes);
  }
  float at(std::size_t x, std::size_t y) const { return row(y)[x]; }

 private:
  relign_image image_;
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

// ---- algorithms ---------------------------------------------------------------------------

// One step as an algorithm sees it. A value: pose and merit may be kept; image() is a view that
// is valid until the next step of the conversation.
struct Observation {
  unsigned step = 0;                                        // 0 = the capture at the start pose
  Pose pose;                                                // commanded
  double merit = std::numeric_limits<double>::quiet_NaN();  // smaller is better; NaN when not granted
  std::uint64_t limits_low = 0;                             // bit i: axis i met its lower limit
  std::uint64_t limits_high = 0;                            // bit i: axis i met its upper limit
  double machine_seconds = 0;

  ImageView image() const {
    if (!image_) throw std::logic_error("no image was granted: declare \"images\" under \"knows\" in the manifest");
    return ImageView(*image_);
  }

  const relign_image* image_ = nullptr;
};

class Measures;
class Prior;
class Model;
struct RunOutcome;

// The host's side of one trial. See relign_conversation for the rules.
class Conversation {
 public:
  explicit Conversation(const relign_conversation* talk) : talk_(talk) {}

  std::size_t axes() const { return talk_->task->axes; }
  unsigned budget() const { return talk_->task->budget; }
  std::uint64_t seed() const { return talk_->task->seed; }
  bool knows(std::uint32_t bits) const { return (talk_->task->knows & bits) == bits; }
  double largest_move() const { return talk_->task->largest_move; }

  // The box to search, in commanded coordinates, under every protocol.
  Box box() const {
    const relign_task* task = talk_->task;
    if (!task->box_lower || !task->box_upper)
      throw std::logic_error("no box was granted: declare \"box\" under \"knows\" in the manifest");
    return {Pose(task->box_lower, task->box_lower + task->axes), Pose(task->box_upper, task->box_upper + task->axes)};
  }

  // Step 0: the capture at the start pose. Costs nothing.
  Observation first() {
    relign_observation seen = empty();
    check(talk_->first(talk_->context, &seen), "first");
    return convert(seen);
  }

  // One move to an absolute commanded pose and one capture; nothing once the budget is spent.
  std::optional<Observation> step(const Pose& pose) { return request(talk_->step, pose, "step"); }

  // The same for a move relative to where the stage is.
  std::optional<Observation> move(const Pose& delta) { return request(talk_->move, delta, "move"); }

  // "I would glue here now."
  void recommend(const Pose& pose) {
    check(talk_->recommend(talk_->context, pose.data(), static_cast<std::uint32_t>(pose.size())), "recommend");
  }

  // Services: what more a trial offers (relign/services.hpp). Each throws std::logic_error when the host does not offer
  // it, and says what is missing in the manifest.
  ImageView reference() const;  // O*; needs "images". Valid during run
  Measures measures() const;    // MTF, contrast, centroid, ... of the last capture; needs "images"
  Prior prior() const;          // draws from the noise level; needs "level"
  Model model() const;          // a simulator of the scene's design; needs "design"
  // Hand-over: runs the algorithm that `parameter` (of type "algorithm") names for at most so many of my steps.
  RunOutcome run(std::string_view parameter, unsigned most_steps, std::string_view parameters_json = {});

  // Any service by its id; null when the host does not offer it.
  const void* service(std::string_view id) const {
    return talk_->get_service ? talk_->get_service(talk_->context, to_text(id)) : nullptr;
  }

 private:
  using Request = relign_status (*)(void*, const double*, std::uint32_t, relign_observation*);

  static relign_observation empty() {
    relign_observation seen{};
    seen.struct_size = sizeof seen;
    return seen;
  }
  std::optional<Observation> request(Request ask, const Pose& pose, const char* what) {
    relign_observation seen = empty();
    const relign_status status = ask(talk_->context, pose.data(), static_cast<std::uint32_t>(pose.size()), &seen);
    if (status == RELIGN_STOP) return std::nullopt;
    check(status, what);
    return convert(seen);
  }
  Observation convert(const relign_observation& seen) const {
    Observation observation;
    observation.step = seen.step;
    observation.pose.assign(seen.pose, seen.pose + axes());
    observation.merit = seen.merit;
    observation.limits_low = seen.limits_low;
    observation.limits_high = seen.limits_high;
    observation.machine_seconds = seen.machine_seconds;
    observation.image_ = seen.image;
    return observation;
  }
  static void check(relign_status status, const char* what) {
    if (status == RELIGN_OK) return;
    if (status == RELIGN_BAD_ARGUMENT)
      throw std::invalid_argument(std::string(what) +
                                  ": the host refused the pose (wrong number of axes, or not finite)");
    throw std::runtime_error(std::string(what) + ": the host reports a failure");
  }
  template <class Service>
  const Service* offered(const char* id, std::uint32_t needed, const char* word) const;
  const relign_conversation* talk_;
  std::shared_ptr<char> run_ = std::make_shared<char>();  // lives as long as run: what is kept longer can tell
};

// An algorithm drives its trial: it returns when the conversation gives no more steps, or earlier
// to declare itself finished. One object runs one trial.
class Algorithm {
 public:
  virtual ~Algorithm() = default;
  virtual void run(Conversation& talk) = 0;
};

// Searches. Without a recommendation of its own, the best measured pose counts.
class Optimizer : public Algorithm {};

// Has learnt, or owns a model. Without a recommendation of its own, the current pose counts.
class Agent : public Algorithm {};

// For authors who prefer to be asked: implement ask and tell instead of run.
template <class Base = Optimizer>
class AskTell : public Base {
 public:
  virtual void begin(Conversation& /*talk*/) {}
  virtual Pose ask() = 0;                          // the next commanded pose
  virtual void tell(const Observation& seen) = 0;  // step 0 included
  virtual std::optional<Pose> recommendation() { return std::nullopt; }
  virtual bool finished() const { return false; }

  void run(Conversation& talk) final {
    begin(talk);
    std::optional<Observation> seen = talk.first();
    while (seen) {
      tell(*seen);
      if (const auto pose = recommendation()) talk.recommend(*pose);
      if (finished()) return;
      seen = talk.step(ask());
    }
  }
};

// ---- noise levels --------------------------------------------------------------------------

class NoiseLevel {
 public:
  virtual ~NoiseLevel() = default;
  // One draw of W as JSON, a pure function of the arguments; see relign_noise_level_interface.
  virtual std::string draw(std::uint64_t seed, std::string_view scene_json) = 0;
};

// ---- scenes ----------------------------------------------------------------------------------

// One lens as assembled. See relign_scene_interface for meanings; poses are true poses in 0..1.
class Assembly {
 public:
  virtual ~Assembly() = default;
  virtual void capture(const Pose& true_pose, std::uint64_t frame_seed, float* pixels) = 0;
  struct Truth {
    double mse;
    double standard_error;
  };
  virtual Truth noise_free_mse(const Pose& true_pose, std::uint64_t seed) = 0;
  // Optional: return false when there is none.
  virtual bool render_noise_free(const Pose& /*true_pose*/, float* /*pixels*/) { return false; }
};

class Scene {
 public:
  virtual ~Scene() = default;
  virtual std::string describe() = 0;
  virtual relign_image reference() = 0;
  virtual std::unique_ptr<Assembly> mount(std::string_view offsets_json) = 0;
};

// A scene that owns its stage: a real machine, of which nobody knows start, distortion and truth. Its
// describe says "owns_stage": true and "truth": false. See relign_scene_stage for the order of calls.
// One object drives one station; what throws ends the trial, and the host makes a new object.
class Station : public Scene {
 public:
  // Brings the lens to a start pose: the same one for equal seeds, as well as the machine can.
  virtual void begin(std::uint64_t seed) = 0;

  struct Moved {
    Pose moved;  // what the stage moved by its own encoders; shorter than asked for where a limit cut it
    std::uint64_t limits_low = 0;   // bit i: axis i met its lower limit
    std::uint64_t limits_high = 0;  // bit i: axis i met its upper limit
    double machine_seconds = 0;     // measured, settling included
  };
  // One move relative to where the stage is, in shares of the travel.
  virtual Moved move_by(const Pose& delta) = 0;

  // One picture from where the stage is (width x height floats). Returns the machine seconds it took.
  virtual double capture(float* pixels) = 0;

  std::unique_ptr<Assembly> mount(std::string_view) final {
    throw std::logic_error("a station takes its lenses from the production, not from a noise level");
  }
};

// ---- the border ------------------------------------------------------------------------------

namespace border {

template <class Body>
relign_status guard(const relign_host* host, Body&& body) noexcept {
  try {
    return body();
  } catch (const Stopped&) {
    return RELIGN_STOP;
  } catch (const std::exception& error) {
    host->fail(host->context, to_text(error.what()));
  } catch (...) {
    host->fail(host->context, to_text("an exception that is no std::exception"));
  }
  return RELIGN_FAILED;
}

template <class Object>
struct Handle {
  const relign_host* host;
  std::unique_ptr<Object> object;
};

template <class Object, class Raw>
Handle<Object>* handle(Raw* raw) {
  return reinterpret_cast<Handle<Object>*>(raw);
}

template <class Made, class Base, class Raw>
relign_status create(const relign_host* host, const relign_parameters* given, Raw** made) {
  return guard(host, [&] {
    auto fresh = std::make_unique<Handle<Base>>();
    fresh->host = host;
    fresh->object = std::make_unique<Made>(Parameters(host, given));
    *made = reinterpret_cast<Raw*>(fresh.release());
    return RELIGN_OK;
  });
}

template <class Base, class Raw>
void destroy(Raw* raw) {
  try {
    delete handle<Base>(raw);
  } catch (...) {
  }
}

inline void write(const relign_text_sink* sink, std::string_view text) { sink->write(sink->context, to_text(text)); }

template <class Made>
const relign_algorithm_interface* algorithm_interface() {
  static const relign_algorithm_interface table = {
      sizeof(relign_algorithm_interface),
      0,
      create<Made, Algorithm, relign_algorithm>,
      [](relign_algorithm* self, const relign_conversation* talk) -> relign_status {
        auto* mine = handle<Algorithm>(self);
        return guard(mine->host, [&] {
          Conversation conversation(talk);
          mine->object->run(conversation);
          return RELIGN_OK;
        });
      },
      destroy<Algorithm, relign_algorithm>,
      nullptr};
  return &table;
}

template <class Made>
const relign_noise_level_interface* noise_level_interface() {
  static const relign_noise_level_interface table = {
      sizeof(relign_noise_level_interface),
      0,
      create<Made, NoiseLevel, relign_noise_level>,
      [](relign_noise_level* self, std::uint64_t seed, relign_text scene_json,
         const relign_text_sink* drawn) -> relign_status {
        auto* mine = handle<NoiseLevel>(self);
        return guard(mine->host, [&] {
          write(drawn, mine->object->draw(seed, to_view(scene_json)));
          return RELIGN_OK;
        });
      },
      destroy<NoiseLevel, relign_noise_level>,
      nullptr};
  return &table;
}

inline const relign_scene_noise_free* scene_noise_free() {
  static const relign_scene_noise_free table = {
      sizeof(relign_scene_noise_free), 0,
      [](relign_assembly* raw, const double* pose, std::uint32_t axes, float* pixels) -> relign_status {
        auto* mine = handle<Assembly>(raw);
        return guard(mine->host, [&] {
          return mine->object->render_noise_free(Pose(pose, pose + axes), pixels) ? RELIGN_OK : RELIGN_UNSUPPORTED;
        });
      }};
  return &table;
}

inline Station& station(relign_scene* self) { return static_cast<Station&>(*handle<Scene>(self)->object); }

inline const relign_scene_stage* scene_stage() {
  static const relign_scene_stage table = {
      sizeof(relign_scene_stage), 0,
      [](relign_scene* self, std::uint64_t seed) -> relign_status {
        return guard(handle<Scene>(self)->host, [&] {
          station(self).begin(seed);
          return RELIGN_OK;
        });
      },
      [](relign_scene* self, const double* delta, std::uint32_t axes, relign_stage_move* made) -> relign_status {
        return guard(handle<Scene>(self)->host, [&] {
          const Station::Moved moved = station(self).move_by(Pose(delta, delta + axes));
          if (moved.moved.size() != axes) throw std::logic_error("move_by returned a move of another number of axes");
          std::copy(moved.moved.begin(), moved.moved.end(), made->moved);
          made->limits_low = moved.limits_low;
          made->limits_high = moved.limits_high;
          made->machine_seconds = moved.machine_seconds;
          return RELIGN_OK;
        });
      },
      [](relign_scene* self, float* pixels, double* machine_seconds) -> relign_status {
        return guard(handle<Scene>(self)->host, [&] {
          *machine_seconds = station(self).capture(pixels);
          return RELIGN_OK;
        });
      }};
  return &table;
}

template <class Made>
const relign_scene_interface* scene_interface() {
  static const relign_scene_interface table = {
      sizeof(relign_scene_interface),
      0,
      create<Made, Scene, relign_scene>,
      [](relign_scene* self, const relign_text_sink* description) -> relign_status {
        auto* mine = handle<Scene>(self);
        return guard(mine->host, [&] {
          write(description, mine->object->describe());
          return RELIGN_OK;
        });
      },
      [](relign_scene* self, relign_image* image) -> relign_status {
        auto* mine = handle<Scene>(self);
        return guard(mine->host, [&] {
          // Never more than the host has room for: its header may be older and the struct smaller.
          relign_image full = mine->object->reference();
          full.struct_size = std::min<std::uint32_t>(image->struct_size, sizeof full);
          std::memcpy(image, &full, full.struct_size);
          return RELIGN_OK;
        });
      },
      [](relign_scene* self, relign_text offsets_json, relign_assembly** made) -> relign_status {
        auto* mine = handle<Scene>(self);
        return guard(mine->host, [&] {
          auto fresh = std::make_unique<Handle<Assembly>>();
          fresh->host = mine->host;
          fresh->object = mine->object->mount(to_view(offsets_json));
          if (!fresh->object) throw std::logic_error("mount returned no assembly");
          *made = reinterpret_cast<relign_assembly*>(fresh.release());
          return RELIGN_OK;
        });
      },
      destroy<Assembly, relign_assembly>,
      [](relign_assembly* raw, const double* pose, std::uint32_t axes, std::uint64_t seed,
         float* pixels) -> relign_status {
        auto* mine = handle<Assembly>(raw);
        return guard(mine->host, [&] {
          mine->object->capture(Pose(pose, pose + axes), seed, pixels);
          return RELIGN_OK;
        });
      },
      [](relign_assembly* raw, const double* pose, std::uint32_t axes, std::uint64_t seed, double* mse,
         double* standard_error) -> relign_status {
        auto* mine = handle<Assembly>(raw);
        return guard(mine->host, [&] {
          const Assembly::Truth truth = mine->object->noise_free_mse(Pose(pose, pose + axes), seed);
          *mse = truth.mse;
          *standard_error = truth.standard_error;
          return RELIGN_OK;
        });
      },
      destroy<Scene, relign_scene>,
      [](relign_scene*, relign_text id) -> const void* {
        if constexpr (std::is_base_of_v<Station, Made>) {
          return to_view(id) == RELIGN_SCENE_STAGE ? scene_stage() : nullptr;
        } else {
          return to_view(id) == RELIGN_SCENE_NOISE_FREE ? scene_noise_free() : nullptr;
        }
      }};
  return &table;
}

template <class Made>
const void* get_interface(relign_text id) {
  const std::string_view asked = to_view(id);
  if constexpr (std::is_base_of_v<Algorithm, Made>) {
    if (asked == RELIGN_ALGORITHM_INTERFACE) return algorithm_interface<Made>();
  } else if constexpr (std::is_base_of_v<NoiseLevel, Made>) {
    if (asked == RELIGN_NOISE_LEVEL_INTERFACE) return noise_level_interface<Made>();
  } else {
    static_assert(std::is_base_of_v<Scene, Made>,
                  "a plugin derives from relign::Optimizer, Agent, NoiseLevel, Scene or Station");
    if (asked == RELIGN_SCENE_INTERFACE) return scene_interface<Made>();
  }
  return nullptr;
}

}  // namespace border
}  // namespace relign

#include <relign/services.hpp>  // IWYU pragma: export

// The manifest's bytes; relign_add_plugin generates their definition.
extern "C" const char relign_manifest_text[];

// Once, at the end of the plugin's main file.
#define RELIGN_PLUGIN(Class)                                                                      \
  extern "C" {                                                                                    \
  RELIGN_EXPORT extern const relign_plugin_description relign_plugin_entry;                       \
  const relign_plugin_description relign_plugin_entry = {sizeof(relign_plugin_description),       \
                                                         RELIGN_ABI_MAJOR,                        \
                                                         RELIGN_ABI_MINOR,                        \
                                                         RELIGN_ABI_MINOR,                        \
                                                         relign_manifest_text,                    \
                                                         "compiler " __VERSION__,                 \
                                                         ::relign::border::get_interface<Class>}; \
  }

#endif  // RELIGN_PLUGIN_HPP
