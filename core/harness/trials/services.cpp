#include "trials/services.h"

#include <algorithm>
#include <cmath>

#include "base/json_source.h"
#include "trials/measure_table.h"
#include "trials/model_service.h"
#include "trials/pretraining_service.h"
#include "trials/run_service.h"
#include "trials/service_answer.h"
#include "trials/trial_host.h"

namespace relign::trials {

relign_status write_text(const relign_text_sink* sink, std::string_view text) {
  if (!sink || !sink->write) return RELIGN_BAD_ARGUMENT;
  sink->write(sink->context, {text.data(), text.size()});
  return RELIGN_OK;
}

bool ServiceContext::is_pose(const double* values, std::uint32_t axes) const {
  return values && axes == view.table().task->axes &&
         std::all_of(values, values + axes, [](double value) { return std::isfinite(value); });
}

Services::Services(TrialHost& host, TrialView& view) : shared_(host, view) {}
Services::~Services() = default;

const void* Services::get(std::string_view id) {
  if (std::this_thread::get_id() != shared_.thread) return nullptr;
  if (id == RELIGN_SERVICE_REFERENCE) return reference();
  if (id == RELIGN_SERVICE_MEASURES) return measures();
  if (id == RELIGN_SERVICE_REGIONS) return regions();
  if (id == RELIGN_SERVICE_PRIOR) return prior();
  if (id == RELIGN_SERVICE_HISTORY) return history();
  if (id == RELIGN_SERVICE_RUN) return run();
  if (id == RELIGN_SERVICE_MODEL) return model();
  if (id == RELIGN_SERVICE_PREPARED) return prepared();
  return nullptr;
}

const SimulatedLens* Services::simulated_lens() const {
  return std::get_if<SimulatedLens>(&shared_.host.setup().stage);
}

const void* Services::reference() {
  if (!shared_.grants(RELIGN_OBSERVES_IMAGES)) return nullptr;
  reference_.struct_size = sizeof reference_;
  reference_.image = &shared_.host.reference_image();
  return &reference_;
}

const void* Services::measures() {
  if (!shared_.grants(RELIGN_OBSERVES_IMAGES)) return nullptr;
  measures_.struct_size = sizeof measures_;
  measures_.context = &shared_;
  measures_.list = [](void* context, const relign_text_sink* sink) {
    auto& shared = *static_cast<ServiceContext*>(context);
    return shared.answer([&] { return write_text(sink, list_measures().dump()); });
  };
  measures_.measure = [](void* context, relign_text name, relign_text arguments_json, double* value) {
    auto& shared = *static_cast<ServiceContext*>(context);
    return shared.answer([&]() -> relign_status {
      if (!value) return shared.refuse("'value' is null");
      const relign_image &capture = shared.host.last_capture(), &reference = shared.host.reference_image();
      *value = measure({capture.pixels, capture.width, capture.height},
                       {reference.pixels, reference.width, reference.height}, shared.host.shown_scene(), text_of(name),
                       text_of(arguments_json));
      return RELIGN_OK;
    });
  };
  measures_.why = tell_why;
  measures_.fields = [](void* context, relign_text arguments_json, relign_field_measures* fields) {
    auto& shared = *static_cast<ServiceContext*>(context);
    return shared.answer([&]() -> relign_status {
      const relign_image& capture = shared.host.last_capture();
      shared.fields = {
          {capture.pixels, capture.width, capture.height}, shared.host.shown_scene(), text_of(arguments_json)};
      shared.fields.write(fields);
      return RELIGN_OK;
    });
  };
  return &measures_;
}

const void* Services::regions() {
  if (!shared_.grants(RELIGN_OBSERVES_IMAGES)) return nullptr;
  regions_.struct_size = sizeof regions_;
  regions_.most = kMaxRegions;
  regions_.context = &shared_;
  regions_.select = [](void* context, const std::uint32_t* numbers, std::uint32_t count) {
    auto& shared = *static_cast<ServiceContext*>(context);
    return shared.answer([&]() -> relign_status {
      const SceneFacts& scene = shared.host.setup().scene;
      if (!numbers && count > 0) return shared.refuse("'regions' is null");
      PixelRegions regions = to_regions(numbers, std::min<std::size_t>(count, kMaxRegions + 1));
      if (const std::string mistake = mistake_of(regions, scene.image_width, scene.image_height); !mistake.empty())
        return shared.refuse(mistake);
      if (!shared.host.captures_regions()) {
        shared.why = "the scene '" + scene.name + "' captures whole frames only";
        return RELIGN_UNSUPPORTED;
      }
      shared.host.select_regions(std::move(regions));
      return RELIGN_OK;
    });
  };
  regions_.why = tell_why;
  return &regions_;
}

namespace {

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

}  // namespace

const void* Services::prior() {
  if (!shared_.grants(RELIGN_OBSERVES_LEVEL) || !simulated_lens()) return nullptr;
  prior_.struct_size = sizeof prior_;
  prior_.context = &shared_;
  prior_.draw = [](void* context, std::uint64_t number, const relign_text_sink* drawn) {
    auto& shared = *static_cast<ServiceContext*>(context);
    return shared.answer_unless_stopped([&] {
      // The training domain shares no seed with benchmark instances, whatever the number.
      const SceneFacts& scene = shared.host.setup().scene;
      plugin_host::NoiseLevel& level = std::get<SimulatedLens>(shared.host.setup().stage).level;
      const Instance made = draw_instance(level, scene, 0, SeedDomain::training, number);
      return write_text(drawn, perturbations_json(made.perturbations));
    });
  };
  prior_.why = tell_why;
  return &prior_;
}

const void* Services::history() {
  if (!shared_.grants(RELIGN_OBSERVES_HISTORY)) return nullptr;
  history_.struct_size = sizeof history_;
  history_.context = &shared_;
  history_.modules = simulated_lens() ? earlier_modules(shared_.host.setup().instance) : 0;
  history_.cure_shift = [](void* context, std::uint32_t back, double* shift, std::uint32_t axes) {
    auto& shared = *static_cast<ServiceContext*>(context);
    return shared.answer_unless_stopped([&]() -> relign_status {
      const TrialSetup& setup = shared.host.setup();
      const auto* lens = std::get_if<SimulatedLens>(&setup.stage);
      const std::uint32_t modules = lens ? earlier_modules(setup.instance) : 0;
      if (!shift || axes != setup.scene.axes.size()) return shared.refuse("expected room for one number per axis");
      if (back < 1 || back > modules)
        return shared.refuse("found module " + std::to_string(back) + " before this one; expected 1 to " +
                             std::to_string(modules));
      const std::vector<double> measured = inspected_shift(lens->level, setup.scene, setup.instance, back);
      std::copy(measured.begin(), measured.end(), shift);
      return RELIGN_OK;
    });
  };
  history_.why = tell_why;
  return &history_;
}

const void* Services::run() {
  if (shared_.view.algorithm().algorithms.empty()) return nullptr;
  if (!run_) run_ = std::make_unique<RunService>(shared_);
  return run_->table();
}

const void* Services::model() {
  const SimulatedLens* lens = simulated_lens();
  if (!shared_.grants(RELIGN_OBSERVES_DESIGN) || !lens) return nullptr;
  if (!model_) model_ = std::make_unique<ModelService>(shared_, lens->model);
  return model_->table();
}

const void* Services::prepared() {
  if (shared_.view.algorithm().plugin->prepare.is_null()) return nullptr;
  if (!prepared_) prepared_ = std::make_unique<PretrainingService>(shared_);
  return prepared_->table();
}

}  // namespace relign::trials
