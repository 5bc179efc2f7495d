// "relign.model/1": a simulator of the scene's design (model_scene.h), for which an algorithm chooses offsets and
// seeds. Its images are pure functions of (offsets, pose, seed) and use nothing of the instance.
#pragma once

#include <list>

#include "plugin_host/objects.h"
#include "trials/model_scene.h"
#include "trials/services.h"

namespace relign::trials {

class ModelService {
 public:
  // `scene` must outlive this object.
  ModelService(ServiceContext& shared, ModelScene& scene) : shared_(&shared), scene_(&scene) {}
  ModelService(const ModelService&) = delete;
  ModelService& operator=(const ModelService&) = delete;

  // Functions of relign_model_service.
  static relign_status mount(void* context, relign_text offsets_json, relign_model_lens** made);
  static relign_status capture(void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                               std::uint64_t seed, float* pixels);
  static relign_status noise_free(void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                  float* pixels);
  static relign_status slopes(void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                              std::uint64_t seed, std::uint32_t samples, const std::uint32_t* elements,
                              std::uint32_t count, float* pixels);
  static relign_status unmount(void* context, relign_model_lens* lens);

 private:
  using Lenses = std::list<plugin_host::MountedAssembly>;
  Lenses::iterator find(relign_model_lens* lens);
  // The lens, if all arguments are valid; otherwise null, with the reason in `why`.
  plugin_host::MountedAssembly* ready(relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                      const float* pixels);

  ServiceContext* shared_;
  ModelScene* scene_;
  Lenses lenses_;  // a list, because the addresses are the handles
};

}  // namespace relign::trials
