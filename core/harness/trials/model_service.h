// "relign.model/1": a simulator of the scene's design (model_scene.h), for which an algorithm chooses offsets and
// seeds. Its images are pure functions of (offsets, pose, seed) and use nothing of the instance.
#pragma once

#include <list>
#include <vector>

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
  static relign_status fields(void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                              relign_text arguments_json, relign_model_fields* fields);
  static relign_status measure(void* context, relign_model_lens* lens, relign_text name, relign_text arguments_json,
                               double* value);
  static relign_status unmount(void* context, relign_model_lens* lens);

 private:
  struct Lens {
    plugin_host::MountedAssembly assembly;
    std::vector<float> last_image = {};  // of capture and noise_free
  };
  using Lenses = std::list<Lens>;
  Lenses::iterator find(relign_model_lens* lens);
  // The lens, if all arguments are valid; otherwise null, with the reason in `why`. `result`: where to write.
  Lens* ready(relign_model_lens* lens, const double* true_pose, std::uint32_t axes, const void* result);
  void keep(Lens& lens, const float* pixels) const;  // as its last image

  ServiceContext* shared_;
  ModelScene* scene_;
  Lenses lenses_;                   // a list, because the addresses are the handles
  std::vector<double> columns_[4];  // that the last answer of `fields` points to
};

}  // namespace relign::trials
