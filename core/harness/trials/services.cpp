#include "trials/services.h"

#include <algorithm>
#include <cmath>

#include "base/json_source.h"
#include "trials/measure_table.h"
#include "trials/model_service.h"
#include "trials/pretraining.h"
#include "trials/run_service.h"
#include "trials/service_answer.h"
#include "trials/trial_host.h"

namespace relign::trials {

relign_status write_text(const relign_text_sink* sink, std::string_view text) {
  if (!sink || !sink->write) return RELIGN_BAD_ARGUMENT;
  sink->write(sink->context, {text.data(), text.size()});
  return RELIGN_OK;
}

ServiceContext::ServiceContext(TrialHost& trial, TrialView& own) : host(trial), view(own) {}
ServiceContext::~ServiceContext() = default;

bool ServiceContext::is_pose(const double* values, std::uint32_t axes) const {
  return values && axes == view.table().task->axes &&
         std::all_of(values, values + axes, [](double value) { return std::isfinite(value); });
}

const SimulatedLens* ServiceContext::simulated_lens() const { return std::get_if<SimulatedLens>(&host.setup().stage); }

namespace {

images::View view_of(const relign_image& image) { return {image.pixels, image.width, image.height}; }

bool offer(ServiceContext& shared, relign_reference_service& table) {
  table.image = &shared.host.reference_image();
  return shared.grants(RELIGN_OBSERVES_IMAGES);
}

bool offer(ServiceContext& shared, relign_measures_service& table) {
  table.list = [](void* context, const relign_text_sink* sink) {
    return answer(context, [&](ServiceContext&) { return write_text(sink, list_measures().dump()); });
  };
  table.measure = [](void* context, relign_text name, relign_text arguments_json, double* value) {
    return answer(context, [&](ServiceContext& now) -> relign_status {
      if (!value) return now.refuse("'value' is null");
      *value = measure(view_of(now.host.last_capture()), view_of(now.host.reference_image()), now.host.shown_scene(),
                       text_of(name), text_of(arguments_json));
      return RELIGN_OK;
    });
  };
  table.fields = [](void* context, relign_text arguments_json, relign_field_measures* fields) {
    return answer(context, [&](ServiceContext& now) -> relign_status {
      now.fields = {view_of(now.host.last_capture()), now.host.shown_scene(), text_of(arguments_json)};
      now.fields.write(fields);
      return RELIGN_OK;
    });
  };
  return shared.grants(RELIGN_OBSERVES_IMAGES);
}

bool offer(ServiceContext& shared, relign_regions_service& table) {
  table.most = kMaxRegions;
  table.select = [](void* context, const std::uint32_t* numbers, std::uint32_t count) {
    return answer(context, [&](ServiceContext& now) -> relign_status {
      const SceneFacts& scene = now.host.setup().scene;
      if (!numbers && count > 0) return now.refuse("'regions' is null");
      PixelRegions regions = to_regions(numbers, std::min<std::size_t>(count, kMaxRegions + 1));
      if (const std::string mistake = mistake_of(regions, scene.image_width, scene.image_height); !mistake.empty())
        return now.refuse(mistake);
      if (!now.host.stage().captures_regions()) {
        now.why = "the scene '" + scene.name + "' captures whole frames only";
        return RELIGN_UNSUPPORTED;
      }
      now.host.select_regions(std::move(regions));
      return RELIGN_OK;
    });
  };
  return shared.grants(RELIGN_OBSERVES_IMAGES);
}

// The JSON form in which a noise level returns W.
std::string perturbations_json(const Perturbations& perturbations) {
  const std::size_t axes = perturbations.start.size();
  Json rows = Json::array();
  for (std::size_t row = 0; row < axes; ++row) {
    const auto first = perturbations.distortion.begin() + static_cast<std::ptrdiff_t>(row * axes);
    rows.push_back(std::vector<double>(first, first + static_cast<std::ptrdiff_t>(axes)));
  }
  Json json = {
      {"start", perturbations.start}, {"distortion", rows}, {"elements", valid_json(perturbations.elements_json)}};
  if (!perturbations.cure_shift.empty()) json["cure_shift"] = perturbations.cure_shift;
  if (const std::optional<StageErrors>& stage = perturbations.stage)
    json["stage"] = {{"backlash", stage->backlash},
                     {"repeatability", stage->repeatability},
                     {"encoder_step", stage->encoder_step},
                     {"drift", stage->drift},
                     {"drift_seconds", stage->drift_seconds}};
  if (const std::optional<ModuleBatch>& batch = perturbations.batch)
    json["batch"] = {{"size", batch->size}, {"cure_shift", batch->cure_shift}, {"inspection", batch->inspection}};
  return canonical_json(json);
}

bool offer(ServiceContext& shared, relign_prior_service& table) {
  table.draw = [](void* context, std::uint64_t number, const relign_text_sink* drawn) {
    return answer_unless_stopped(context, [&](ServiceContext& now) {
      // The training domain shares no seed with benchmark instances, whatever the number.
      const Instance made =
          draw_instance(now.simulated_lens()->level, now.host.setup().scene, 0, SeedDomain::training, number);
      return write_text(drawn, perturbations_json(made.perturbations));
    });
  };
  return shared.grants(RELIGN_OBSERVES_LEVEL) && shared.simulated_lens();
}

std::uint32_t modules_before(const ServiceContext& shared) {
  return shared.simulated_lens() ? earlier_modules(shared.host.setup().instance) : 0;
}

bool offer(ServiceContext& shared, relign_history_service& table) {
  table.modules = modules_before(shared);
  table.cure_shift = [](void* context, std::uint32_t back, double* shift, std::uint32_t axes) {
    return answer_unless_stopped(context, [&](ServiceContext& now) -> relign_status {
      const TrialSetup& setup = now.host.setup();
      const std::uint32_t modules = modules_before(now);
      if (!shift || axes != setup.scene.axes.size()) return now.refuse("expected room for one number per axis");
      if (back < 1 || back > modules)
        return now.refuse("found module " + std::to_string(back) + " before this one; expected 1 to " +
                          std::to_string(modules));
      const std::vector<double> measured =
          inspected_shift(now.simulated_lens()->level, setup.scene, setup.instance, back);
      std::copy(measured.begin(), measured.end(), shift);
      return RELIGN_OK;
    });
  };
  return shared.grants(RELIGN_OBSERVES_HISTORY);
}

constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;  // of pretrained data

// Null outside of pretraining, and for an algorithm that another one runs.
PretrainingState* pretraining_state(const ServiceContext& shared) {
  const auto* pretraining = std::get_if<Pretraining>(&shared.host.setup().purpose);
  return pretraining && &shared.view == &shared.host ? &pretraining->state : nullptr;
}

relign_status load(ServiceContext& shared, const relign_text_sink* data) {
  if (const PretrainingState* now = pretraining_state(shared)) {
    shared.why = "no data: no earlier source instance has saved any";
    return now->bytes ? write_text(data, *now->bytes) : RELIGN_UNSUPPORTED;
  }
  const PreparedByIdentity& prepared = shared.host.setup().prepared;
  const auto found = prepared.find(shared.view.algorithm().identity);
  const bool known = found != prepared.end();
  if (known && found->second.bytes) return write_text(data, *found->second.bytes);
  if (known && !found->second.failure.empty()) {
    shared.why = found->second.failure;
    return RELIGN_FAILED;
  }
  shared.why = "no pretrained data for this trial";
  return RELIGN_UNSUPPORTED;
}

relign_status save(ServiceContext& shared, relign_text data) {
  PretrainingState* now = pretraining_state(shared);
  if (!now) return shared.refuse("cannot save in a benchmark trial, only in pretraining on a source instance");
  if (data.size > kMaxBytes)
    return shared.refuse("found " + std::to_string(data.size) + " bytes; expected at most 1 GiB");
  if (!data.data && data.size > 0) return shared.refuse("'data' is null");
  now->bytes = std::make_shared<const std::string>(text_of(data));
  return RELIGN_OK;
}

bool offer(ServiceContext& shared, relign_prepared_service& table) {
  const PretrainingState* now = pretraining_state(shared);
  table.active = now ? 1 : 0;
  table.source = now ? now->source : 0;
  table.sources = now ? now->sources : 0;
  table.load = [](void* context, const relign_text_sink* data) {
    return answer(context, [&](ServiceContext& own) { return load(own, data); });
  };
  table.save = [](void* context, relign_text data) {
    return answer(context, [&](ServiceContext& own) { return save(own, data); });
  };
  return !shared.view.algorithm().plugin->prepare.is_null();
}

}  // namespace

const void* Services::get(std::string_view id) {
  if (std::this_thread::get_id() != shared_.thread) return nullptr;
  return plugin_host::find_service(tables_, id, [&](auto& table) {
    table.struct_size = sizeof table;
    table.context = &shared_;
    return offer(shared_, table);
  });
}

}  // namespace relign::trials
