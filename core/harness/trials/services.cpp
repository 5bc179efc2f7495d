#include "trials/services.h"

#include <algorithm>
#include <cmath>

#include "base/json_source.h"
#include "trials/conversation.h"
#include "trials/measure_table.h"
#include "trials/model_service.h"
#include "trials/prepared_service.h"
#include "trials/run_service.h"
#include "trials/service_answer.h"

namespace relign::trials {

relign_status write_text(const relign_text_sink* sink, std::string_view text) {
  if (!sink || !sink->write) return RELIGN_BAD_ARGUMENT;
  sink->write(sink->context, {text.data(), text.size()});
  return RELIGN_OK;
}

bool ServiceSite::is_pose(const double* values, std::uint32_t axes) const {
  return values && axes == seat.table().task->axes &&
         std::all_of(values, values + axes, [](double value) { return std::isfinite(value); });
}

Services::Services(Conversation& host, Seat& seat) : site_(host, seat) {}
Services::~Services() = default;

const void* Services::get(std::string_view id) {
  if (std::this_thread::get_id() != site_.thread) return nullptr;
  if (id == RELIGN_SERVICE_REFERENCE) return reference();
  if (id == RELIGN_SERVICE_MEASURES) return measures();
  if (id == RELIGN_SERVICE_PRIOR) return prior();
  if (id == RELIGN_SERVICE_RUN) return run();
  if (id == RELIGN_SERVICE_MODEL) return model();
  if (id == RELIGN_SERVICE_PREPARED) return prepared();
  return nullptr;
}

const void* Services::reference() {
  if (!site_.grants(RELIGN_KNOWS_IMAGES)) return nullptr;
  reference_.struct_size = sizeof reference_;
  reference_.image = &site_.host.reference_image();
  return &reference_;
}

const void* Services::measures() {
  if (!site_.grants(RELIGN_KNOWS_IMAGES)) return nullptr;
  measures_.struct_size = sizeof measures_;
  measures_.context = &site_;
  measures_.list = [](void* context, const relign_text_sink* sink) {
    auto& site = *static_cast<ServiceSite*>(context);
    return site.answer([&] { return write_text(sink, list_measures().dump()); });
  };
  measures_.measure = [](void* context, relign_text name, relign_text arguments_json, double* value) {
    auto& site = *static_cast<ServiceSite*>(context);
    return site.answer([&]() -> relign_status {
      if (!value) return site.refuse("there is no place for the value");
      const relign_image &seen = site.host.last_capture(), &wanted = site.host.reference_image();
      *value = measure({seen.pixels, seen.width, seen.height}, {wanted.pixels, wanted.width, wanted.height},
                       text_of(name), text_of(arguments_json));
      return RELIGN_OK;
    });
  };
  measures_.why = tell_why;
  return &measures_;
}

namespace {

// W in the form that a level writes.
std::string variances_json(const Variances& variances) {
  const std::size_t axes = variances.start.size();
  Json rows = Json::array();
  for (std::size_t row = 0; row < axes; ++row) {
    const auto first = variances.distortion.begin() + static_cast<std::ptrdiff_t>(row * axes);
    rows.push_back(std::vector<double>(first, first + static_cast<std::ptrdiff_t>(axes)));
  }
  Json json = {{"start", variances.start}, {"distortion", rows}, {"elements", Json::parse(variances.elements_json)}};
  if (!variances.cure_shift.empty()) json["cure_shift"] = variances.cure_shift;
  return canonical_json(json);
}

}  // namespace

const void* Services::prior() {
  const TrialSetup& setup = site_.host.setup();
  if (!site_.grants(RELIGN_KNOWS_LEVEL) || !setup.level || setup.scene->owns_stage) return nullptr;
  prior_.struct_size = sizeof prior_;
  prior_.context = &site_;
  prior_.draw = [](void* context, std::uint64_t number, const relign_text_sink* drawn) {
    auto& site = *static_cast<ServiceSite*>(context);
    return site.answer_unless_stopped([&] {
      // Of the domain of training: no benchmark instance has such a seed, whatever the number.
      const TrialSetup& trial = site.host.setup();
      const std::uint64_t seed = instance_seed(0, SeedDomain::training, number);
      return write_text(drawn,
                        variances_json(read_variances(trial.level->draw(seed, trial.scene->text), *trial.scene, "")));
    });
  };
  prior_.why = tell_why;
  return &prior_;
}

const void* Services::run() {
  if (site_.seat.algorithm().algorithms.empty()) return nullptr;
  if (!run_) run_ = std::make_unique<RunService>(site_);
  return run_->table();
}

const void* Services::model() {
  const TrialSetup& setup = site_.host.setup();
  if (!site_.grants(RELIGN_KNOWS_DESIGN) || !setup.design || setup.scene->owns_stage) return nullptr;
  if (!model_) model_ = std::make_unique<ModelService>(site_);
  return model_->table();
}

const void* Services::prepared() {
  if (site_.seat.algorithm().plugin->prepare.is_null()) return nullptr;
  if (!prepared_) prepared_ = std::make_unique<PreparedService>(site_);
  return prepared_->table();
}

}  // namespace relign::trials
