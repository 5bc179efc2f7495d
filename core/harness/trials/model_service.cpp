#include "trials/model_service.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <set>
#include <string>

#include "base/seeds.h"
#include "trials/instance.h"
#include "trials/measure_table.h"
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

bool offer(ServiceContext& shared, relign_model_service& table) {
  const SimulatedLens* lens = shared.simulated_lens();
  if (!shared.grants(RELIGN_OBSERVES_DESIGN) || !lens) return false;
  if (!shared.model) shared.model = std::make_unique<ModelService>(shared, lens->model);
  const SceneFacts& facts = shared.host.setup().scene;
  table.scene_json = {facts.text.data(), facts.text.size()};
  table.image_width = facts.image_width;
  table.image_height = facts.image_height;
  table.mount = ModelService::mount;
  table.capture = ModelService::capture;
  table.noise_free = ModelService::noise_free;
  table.slopes = ModelService::slopes;
  table.fields = ModelService::fields;
  table.measure = ModelService::measure;
  table.unmount = ModelService::unmount;
  return true;
}

ModelService::Lenses::iterator ModelService::find(relign_model_lens* lens) {
  return std::find_if(lenses_.begin(), lenses_.end(),
                      [&](const auto& known) { return static_cast<const void*>(&known) == lens; });
}

relign_status ModelService::mount(void* context, relign_text offsets_json, relign_model_lens** made) {
  return answer_unless_stopped(context, [&](ServiceContext& shared) -> relign_status {
    ModelService& model = *shared.model;
    if (!made) return shared.refuse("'made' is null");
    if (model.lenses_.size() >= kMaxLenses)
      return shared.refuse("16 lenses are mounted, the maximum; unmount one of them first");
    const SceneFacts& facts = shared.host.setup().scene;
    model.lenses_.push_back({model.scene_->get(facts).mount(read_offsets(text_of(offsets_json), facts))});
    *made = reinterpret_cast<relign_model_lens*>(&model.lenses_.back());
    return RELIGN_OK;
  });
}

ModelService::Lens* ModelService::ready(relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                        const void* result) {
  const auto found = find(lens);
  if (found == lenses_.end()) {
    shared_->refuse("this lens is not mounted");
  } else if (!shared_->is_pose(true_pose, axes)) {
    shared_->refuse("invalid pose; expected one finite number per axis");
  } else if (!result) {
    shared_->refuse("the place of the result is null");
  } else {
    return &*found;
  }
  return nullptr;
}

void ModelService::keep(Lens& lens, const float* pixels) const {
  const SceneFacts& facts = shared_->host.setup().scene;
  lens.last_image.assign(pixels, pixels + std::size_t{facts.image_width} * facts.image_height);
}

relign_status ModelService::capture(void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                    std::uint64_t seed, float* pixels) {
  return answer_unless_stopped(context, [&](ServiceContext& shared) -> relign_status {
    ModelService& model = *shared.model;
    Lens* mounted = model.ready(lens, true_pose, axes, pixels);
    if (!mounted) return RELIGN_BAD_ARGUMENT;
    mounted->assembly.capture(std::vector<double>(true_pose, true_pose + axes), frame_of(seed), pixels);
    model.keep(*mounted, pixels);
    return RELIGN_OK;
  });
}

relign_status ModelService::noise_free(void* context, relign_model_lens* lens, const double* true_pose,
                                       std::uint32_t axes, float* pixels) {
  return answer_unless_stopped(context, [&](ServiceContext& shared) -> relign_status {
    ModelService& model = *shared.model;
    Lens* mounted = model.ready(lens, true_pose, axes, pixels);
    if (!mounted) return RELIGN_BAD_ARGUMENT;
    if (!mounted->assembly.render_noise_free(std::vector<double>(true_pose, true_pose + axes), pixels)) {
      shared.why = "the scene offers no noise-free images";
      return RELIGN_UNSUPPORTED;
    }
    model.keep(*mounted, pixels);
    return RELIGN_OK;
  });
}

relign_status ModelService::slopes(void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                   std::uint64_t seed, std::uint32_t samples, const std::uint32_t* elements,
                                   std::uint32_t count, float* pixels) {
  return answer_unless_stopped(context, [&](ServiceContext& shared) -> relign_status {
    ModelService& model = *shared.model;
    Lens* mounted = model.ready(lens, true_pose, axes, pixels);
    if (!mounted) return RELIGN_BAD_ARGUMENT;
    if (samples == 0) return shared.refuse("expected at least 1 sample per pixel, found 0");
    if (!elements && count > 0) return shared.refuse("'elements' is null");
    const std::vector<std::uint32_t> which(elements, elements + count);
    const std::size_t most = shared.host.setup().scene.elements.size();
    const std::set<std::uint32_t> once(which.begin(), which.end());
    if (once.size() < which.size() || (!once.empty() && *once.rbegin() >= most))
      return shared.refuse("expected different elements, as numbers below " + std::to_string(most));
    const std::vector<double> pose(true_pose, true_pose + axes);
    if (!mounted->assembly.render_slopes(pose, frame_of(seed), samples, which, pixels)) {
      shared.why = "the scene offers no derivatives of images";
      return RELIGN_UNSUPPORTED;
    }
    const SceneFacts& facts = shared.host.setup().scene;
    const std::size_t numbers =
        std::size_t{facts.image_width} * facts.image_height * (1 + axes + 5 * std::size_t{count});
    if (std::all_of(pixels, pixels + numbers, [](float value) { return std::isfinite(value); })) return RELIGN_OK;
    shared.why = "the derivatives at this pose are not finite; expected a pose near 0 to 1";
    return RELIGN_FAILED;
  });
}

relign_status ModelService::fields(void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                   relign_text arguments_json, relign_model_fields* fields) {
  return answer_unless_stopped(context, [&](ServiceContext& shared) -> relign_status {
    ModelService& model = *shared.model;
    Lens* mounted = model.ready(lens, true_pose, axes, fields);
    if (!mounted) return RELIGN_BAD_ARGUMENT;
    relign_model_fields written{};
    if (fields->struct_size < sizeof written) return shared.refuse("the struct_size of 'fields' is too small");
    const SceneFacts& facts = shared.host.setup().scene;
    const double cycles_per_pixel = cycles_per_pixel_of(facts, text_of(arguments_json));
    if (!(facts.pitch_um > 0)) return shared.refuse("the scene describes no 'pitch_um'");
    std::vector<std::uint32_t> every(facts.fields.size());
    std::iota(every.begin(), every.end(), 0U);
    const FieldValues found = mounted->assembly.fields(std::vector<double>(true_pose, true_pose + axes),
                                                       cycles_per_pixel / facts.pitch_um * 1000, every);
    if (found.empty()) {
      shared.why = "the scene measures no MTF of its fields";
      return RELIGN_UNSUPPORTED;
    }
    for (auto& column : model.columns_) column.clear();
    auto& [x, y, tangential, sagittal] = model.columns_;
    for (const auto& field : found) {
      x.push_back(field.x_px);
      y.push_back(field.y_px);
      tangential.push_back(field.tangential);
      sagittal.push_back(field.sagittal);
    }
    written = {.struct_size = sizeof written,
               .count = static_cast<std::uint32_t>(x.size()),
               .x_px = x.data(),
               .y_px = y.data(),
               .tangential = tangential.data(),
               .sagittal = sagittal.data()};
    std::memcpy(fields, &written, sizeof written);
    return RELIGN_OK;
  });
}

relign_status ModelService::measure(void* context, relign_model_lens* lens, relign_text name,
                                    relign_text arguments_json, double* value) {
  return answer_unless_stopped(context, [&](ServiceContext& shared) -> relign_status {
    ModelService& model = *shared.model;
    const auto found = model.find(lens);
    if (found == model.lenses_.end()) return shared.refuse("this lens is not mounted");
    if (found->last_image.empty())
      return shared.refuse("no image was made of this lens; call capture or noise_free first");
    if (!value) return shared.refuse("'value' is null");
    const SceneFacts& facts = shared.host.setup().scene;
    const relign_image& reference = shared.host.reference_image();
    *value = trials::measure({found->last_image.data(), facts.image_width, facts.image_height},
                             {reference.pixels, reference.width, reference.height}, facts, text_of(name),
                             text_of(arguments_json));
    return RELIGN_OK;
  });
}

relign_status ModelService::unmount(void* context, relign_model_lens* lens) {
  return answer(context, [&](ServiceContext& shared) -> relign_status {
    ModelService& model = *shared.model;
    const auto found = model.find(lens);
    if (found == model.lenses_.end()) return shared.refuse("this lens is not mounted");
    model.lenses_.erase(found);
    return RELIGN_OK;
  });
}

}  // namespace relign::trials
