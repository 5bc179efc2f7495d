// relign/border.hpp: the tables of functions that a plugin's library gives to the host, made from its class. Nothing
// is thrown across: a guard around every entry turns what a member throws into a failure with its text.
//
// For RELIGN_PLUGIN alone; authors need nothing of it.
#ifndef RELIGN_BORDER_HPP
#define RELIGN_BORDER_HPP

#include <relign/plugin.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <relign/ability_tables.hpp>
#include <relign/algorithm.hpp>
#include <relign/handle.hpp>
#include <relign/noise_level.hpp>
#include <relign/scene.hpp>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>

namespace relign::border {

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
      [](relign_algorithm* self, const relign_trial* calls) -> relign_status {
        auto* mine = handle<Algorithm>(self);
        return guard(mine->host, [&] {
          Trial trial(calls);
          mine->object->run(trial);
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

inline std::vector<Scene::BatchItem> to_items(const relign_batch* batch, std::uint32_t axes) {
  std::vector<Scene::BatchItem> items(batch->count);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const double* const pose = batch->true_poses + i * axes;
    items[i] = {handle<Assembly>(batch->assemblies[i])->object.get(), Pose(pose, pose + axes), batch->seeds[i]};
  }
  return items;
}

inline const relign_scene_batch* scene_batch() {
  static const relign_scene_batch table = {
      sizeof(relign_scene_batch), 0,
      [](relign_scene* self, const relign_text_sink* why) -> relign_status {
        auto* mine = handle<Scene>(self);
        return guard(mine->host, [&] {
          const std::string problem = mine->object->open_gpu();
          if (problem.empty()) return RELIGN_OK;
          write(why, problem);
          return RELIGN_UNSUPPORTED;
        });
      },
      [](relign_scene* self, const relign_batch* batch, std::uint32_t axes, const std::uint32_t* places, float* images,
         double* rmse) -> relign_status {
        auto* mine = handle<Scene>(self);
        return guard(mine->host, [&] {
          const std::vector<double> found =
              mine->object->capture_batch(to_items(batch, axes), {places, places + batch->count}, images);
          if (found.size() != batch->count)
            throw std::logic_error("capture_batch: another number of values than items");
          std::copy(found.begin(), found.end(), rmse);
          return RELIGN_OK;
        });
      },
      [](relign_scene* self, const relign_batch* batch, std::uint32_t axes, double* mse,
         double* standard_error) -> relign_status {
        auto* mine = handle<Scene>(self);
        return guard(mine->host, [&] {
          const std::vector<Assembly::Truth> found = mine->object->mse_batch(to_items(batch, axes));
          if (found.size() != batch->count) throw std::logic_error("mse_batch: another number of values than items");
          for (std::size_t i = 0; i < found.size(); ++i) {
            mse[i] = found[i].mse;
            standard_error[i] = found[i].standard_error;
          }
          return RELIGN_OK;
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
      [](relign_scene* self, relign_text id) -> const void* {
        if constexpr (std::is_base_of_v<Station, Made>) {
          return to_view(id) == RELIGN_SCENE_STAGE ? scene_stage() : nullptr;
        } else {
          Scene& scene = *handle<Scene>(self)->object;
          if (to_view(id) == RELIGN_SCENE_BATCH) return scene.captures_batches() ? scene_batch() : nullptr;
          return ability_table(scene, to_view(id));
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

}  // namespace relign::border

#endif  // RELIGN_BORDER_HPP
