#include "trials/model_service.h"

#include <algorithm>

#include "base/seeds.h"
#include "trials/instance.h"
#include "trials/service_answer.h"
#include "trials/trial_host.h"

namespace relign::trials {
namespace {

constexpr std::size_t kMaxLenses = 16;  // each has tables of rays in memory

// Maps the algorithm's seed into the training domain, where no frame of a benchmark instance can be reproduced.
std::uint64_t frame_of(std::uint64_t chosen_seed) {
  return frame_seed(instance_seed(0, SeedDomain::training, chosen_seed), 0, FrameStream::capture);
}

}  // namespace

ModelService::ModelService(ServiceContext& shared, ModelScene& scene) : shared_(&shared), scene_(&scene) {
  const SceneFacts& facts = shared.host.setup().scene;
  table_.struct_size = sizeof table_;
  table_.context = this;
  table_.scene_json = {facts.text.data(), facts.text.size()};
  table_.image_width = facts.image_width;
  table_.image_height = facts.image_height;
  table_.mount = mount;
  table_.capture = capture;
  table_.noise_free = noise_free;
  table_.unmount = unmount;
  table_.why = why;
}

ModelService::Lenses::iterator ModelService::find(relign_model_lens* lens) {
  return std::find_if(lenses_.begin(), lenses_.end(),
                      [&](const auto& known) { return static_cast<const void*>(&known) == lens; });
}

relign_status ModelService::mount(void* context, relign_text offsets_json, relign_model_lens** made) {
  ModelService& model = self(context);
  return model.shared_->answer_unless_stopped([&]() -> relign_status {
    if (!made) return model.shared_->refuse("'made' is null");
    if (model.lenses_.size() >= kMaxLenses)
      return model.shared_->refuse("16 lenses are mounted, the maximum; unmount one of them first");
    const SceneFacts& facts = model.shared_->host.setup().scene;
    model.lenses_.push_back(model.scene_->get(facts).mount(read_offsets(text_of(offsets_json), facts)));
    *made = reinterpret_cast<relign_model_lens*>(&model.lenses_.back());
    return RELIGN_OK;
  });
}

plugin_host::MountedAssembly* ModelService::ready(relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                                  const float* pixels) {
  const auto found = find(lens);
  if (found == lenses_.end()) {
    shared_->refuse("this lens is not mounted");
  } else if (!shared_->is_pose(true_pose, axes)) {
    shared_->refuse("invalid pose; expected one finite number per axis");
  } else if (!pixels) {
    shared_->refuse("'pixels' is null");
  } else {
    return &*found;
  }
  return nullptr;
}

relign_status ModelService::capture(void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                    std::uint64_t seed, float* pixels) {
  ModelService& model = self(context);
  return model.shared_->answer_unless_stopped([&]() -> relign_status {
    plugin_host::MountedAssembly* assembly = model.ready(lens, true_pose, axes, pixels);
    if (!assembly) return RELIGN_BAD_ARGUMENT;
    assembly->capture(std::vector<double>(true_pose, true_pose + axes), frame_of(seed), pixels);
    return RELIGN_OK;
  });
}

relign_status ModelService::noise_free(void* context, relign_model_lens* lens, const double* true_pose,
                                       std::uint32_t axes, float* pixels) {
  ModelService& model = self(context);
  return model.shared_->answer_unless_stopped([&]() -> relign_status {
    plugin_host::MountedAssembly* assembly = model.ready(lens, true_pose, axes, pixels);
    if (!assembly) return RELIGN_BAD_ARGUMENT;
    if (assembly->render_noise_free(std::vector<double>(true_pose, true_pose + axes), pixels)) return RELIGN_OK;
    model.shared_->why = "the scene offers no noise-free images";
    return RELIGN_UNSUPPORTED;
  });
}

relign_status ModelService::unmount(void* context, relign_model_lens* lens) {
  ModelService& model = self(context);
  return model.shared_->answer([&]() -> relign_status {
    const auto found = model.find(lens);
    if (found == model.lenses_.end()) return model.shared_->refuse("this lens is not mounted");
    model.lenses_.erase(found);
    return RELIGN_OK;
  });
}

relign_status ModelService::why(void* context, const relign_text_sink* sentence) {
  return tell_why(self(context).shared_, sentence);
}

}  // namespace relign::trials
