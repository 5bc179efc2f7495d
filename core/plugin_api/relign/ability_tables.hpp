// relign/ability_tables.hpp: the tables of an assembly's abilities, for relign/border.hpp.
// Made by core/plugin_api/generate.py from scene.toml.
// clang-format off
#ifndef RELIGN_ABILITY_TABLES_HPP
#define RELIGN_ABILITY_TABLES_HPP

#include <relign/plugin.h>

#include <relign/handle.hpp>
#include <relign/scene.hpp>

namespace relign::border {

inline const relign_scene_noise_free* scene_noise_free() {
  static const relign_scene_noise_free table = {
      sizeof(relign_scene_noise_free), 0,
      [](relign_assembly* assembly, const double* pose, std::uint32_t axes, float* pixels) -> relign_status {
        auto* mine = handle<Assembly>(assembly);
        return guard(mine->host, [&] {
          const auto found = mine->object->render_noise_free(Pose(pose, pose + axes), pixels);
          if (!found) return RELIGN_UNSUPPORTED;
          return RELIGN_OK;
        });
      }};
  return &table;
}

inline const relign_scene_average* scene_average() {
  static const relign_scene_average table = {
      sizeof(relign_scene_average), 0,
      [](relign_assembly* assembly, const double* pose, std::uint32_t axes, std::uint64_t seed, double error,
          std::uint64_t samples, float* pixels, double* standard_error, std::uint64_t* samples_used) -> relign_status {
        auto* mine = handle<Assembly>(assembly);
        return guard(mine->host, [&] {
          const auto found = mine->object->render_average(Pose(pose, pose + axes), seed, error, samples, pixels);
          if (!found) return RELIGN_UNSUPPORTED;
          *standard_error = found->standard_error;
          *samples_used = found->samples_used;
          return RELIGN_OK;
        });
      }};
  return &table;
}

inline const relign_scene_slopes* scene_slopes() {
  static const relign_scene_slopes table = {
      sizeof(relign_scene_slopes), 0,
      [](relign_assembly* assembly, const double* pose, std::uint32_t axes, std::uint64_t seed, std::uint32_t samples,
          const std::uint32_t* elements, std::uint32_t count, float* pixels) -> relign_status {
        auto* mine = handle<Assembly>(assembly);
        return guard(mine->host, [&] {
          const auto found = mine->object->render_slopes(Pose(pose, pose + axes), seed, samples,
              {elements, elements + count}, pixels);
          if (!found) return RELIGN_UNSUPPORTED;
          return RELIGN_OK;
        });
      }};
  return &table;
}

inline const relign_scene_optimum* scene_optimum() {
  static const relign_scene_optimum table = {
      sizeof(relign_scene_optimum), 0,
      [](relign_assembly* assembly, std::uint64_t seed, double* true_pose, std::uint32_t axes, double* mse,
          double* standard_error) -> relign_status {
        auto* mine = handle<Assembly>(assembly);
        return guard(mine->host, [&] {
          const auto found = mine->object->own_optimum(seed);
          if (!found) return RELIGN_UNSUPPORTED;
          check_count("own_optimum", found->true_pose.size(), axes);
          std::copy(found->true_pose.begin(), found->true_pose.end(), true_pose);
          *mse = found->mse;
          *standard_error = found->standard_error;
          return RELIGN_OK;
        });
      }};
  return &table;
}

inline const relign_scene_further_score* scene_further_score() {
  static const relign_scene_further_score table = {
      sizeof(relign_scene_further_score), 0,
      [](relign_assembly* assembly, const double* pose, std::uint32_t axes, std::uint64_t seed, std::uint32_t which,
          double* value) -> relign_status {
        auto* mine = handle<Assembly>(assembly);
        return guard(mine->host, [&] {
          const auto found = mine->object->further_score(Pose(pose, pose + axes), seed, which);
          if (!found) return RELIGN_UNSUPPORTED;
          *value = *found;
          return RELIGN_OK;
        });
      }};
  return &table;
}

inline const relign_scene_mtf* scene_mtf() {
  static const relign_scene_mtf table = {
      sizeof(relign_scene_mtf), 0,
      [](relign_assembly* assembly, const double* pose, std::uint32_t axes, double lp_per_mm, double* centre,
          double* corner) -> relign_status {
        auto* mine = handle<Assembly>(assembly);
        return guard(mine->host, [&] {
          const auto found = mine->object->mtf(Pose(pose, pose + axes), lp_per_mm);
          if (!found) return RELIGN_UNSUPPORTED;
          *centre = found->centre;
          *corner = found->corner;
          return RELIGN_OK;
        });
      }};
  return &table;
}

inline const relign_scene_fields* scene_fields() {
  static const relign_scene_fields table = {
      sizeof(relign_scene_fields), 0,
      [](relign_assembly* assembly, const double* pose, std::uint32_t axes, double lp_per_mm,
          const std::uint32_t* which, std::uint32_t count, double* x_px, double* y_px, double* tangential,
          double* sagittal) -> relign_status {
        auto* mine = handle<Assembly>(assembly);
        return guard(mine->host, [&] {
          const auto found = mine->object->fields(Pose(pose, pose + axes), lp_per_mm, {which, which + count});
          if (found.empty()) return RELIGN_UNSUPPORTED;
          check_count("fields", found.size(), count);
          for (std::size_t i = 0; i < found.size(); ++i) {
            x_px[i] = found[i].x_px;
            y_px[i] = found[i].y_px;
            tangential[i] = found[i].tangential;
            sagittal[i] = found[i].sagittal;
          }
          return RELIGN_OK;
        });
      }};
  return &table;
}

inline const relign_scene_regions* scene_regions() {
  static const relign_scene_regions table = {
      sizeof(relign_scene_regions), 0,
      [](relign_assembly* assembly, const double* pose, std::uint32_t axes, std::uint64_t seed,
          const std::uint32_t* regions, std::uint32_t count, float* pixels, double* share) -> relign_status {
        auto* mine = handle<Assembly>(assembly);
        return guard(mine->host, [&] {
          const auto found = mine->object->capture_regions(Pose(pose, pose + axes), seed, to_regions(regions, count),
              pixels);
          if (!found) return RELIGN_UNSUPPORTED;
          *share = *found;
          return RELIGN_OK;
        });
      }};
  return &table;
}

// The table of an ability by its id; null when the scene does not offer it.
inline const void* ability_table([[maybe_unused]] const Scene& scene, std::string_view id) {
  if (id == RELIGN_SCENE_NOISE_FREE) return scene_noise_free();
  if (id == RELIGN_SCENE_AVERAGE) return scene_average();
  if (id == RELIGN_SCENE_SLOPES) return scene_slopes();
  if (id == RELIGN_SCENE_OPTIMUM) return scene_optimum();
  if (id == RELIGN_SCENE_FURTHER_SCORE) return scene_further_score();
  if (id == RELIGN_SCENE_MTF) return scene_mtf();
  if (id == RELIGN_SCENE_FIELDS) return scene_fields();
  if (id == RELIGN_SCENE_REGIONS) return scene.captures_regions() ? scene_regions() : nullptr;
  return nullptr;
}

}  // namespace relign::border

#endif  // RELIGN_ABILITY_TABLES_HPP
