#include "plugin_host/service_shield.h"

namespace relign::plugin_host {

template <class Service, auto Function, class... Arguments>
relign_status ShieldedServices::pass(void* context, Arguments... arguments) {
  const auto* pair = static_cast<const Pair<Service>*>(context);
  return pair->shield->call([&] { return (pair->inner->*Function)(pair->inner->context, arguments...); });
}

template <class Service>
void ShieldedServices::fill(Pair<Service>& pair, const void* service) {
  pair.inner = static_cast<const Service*>(service);
  pair.shield = shield_;
  pair.outer.struct_size = sizeof pair.outer;
  pair.outer.context = &pair;
}

const void* ShieldedServices::shielded(std::string_view id, const void* service) {
  if (!service) return nullptr;
  if (id == RELIGN_SERVICE_REFERENCE) return service;  // it has no functions
  if (id == RELIGN_SERVICE_MEASURES) {
    using Table = relign_measures_service;
    fill(measures_, service);
    measures_.outer.list = pass<Table, &Table::list, const relign_text_sink*>;
    measures_.outer.measure = pass<Table, &Table::measure, relign_text, relign_text, double*>;
    measures_.outer.why = pass<Table, &Table::why, const relign_text_sink*>;
    measures_.outer.fields = pass<Table, &Table::fields, relign_text, relign_field_measures*>;
    return &measures_.outer;
  }
  if (id == RELIGN_SERVICE_REGIONS) {
    using Table = relign_regions_service;
    fill(regions_, service);
    regions_.outer.most = regions_.inner->most;
    regions_.outer.select = pass<Table, &Table::select, const std::uint32_t*, std::uint32_t>;
    regions_.outer.why = pass<Table, &Table::why, const relign_text_sink*>;
    return &regions_.outer;
  }
  if (id == RELIGN_SERVICE_PRIOR) {
    using Table = relign_prior_service;
    fill(prior_, service);
    prior_.outer.draw = pass<Table, &Table::draw, std::uint64_t, const relign_text_sink*>;
    prior_.outer.why = pass<Table, &Table::why, const relign_text_sink*>;
    return &prior_.outer;
  }
  if (id == RELIGN_SERVICE_HISTORY) {
    using Table = relign_history_service;
    fill(history_, service);
    history_.outer.modules = history_.inner->modules;
    history_.outer.cure_shift = pass<Table, &Table::cure_shift, std::uint32_t, double*, std::uint32_t>;
    history_.outer.why = pass<Table, &Table::why, const relign_text_sink*>;
    return &history_.outer;
  }
  if (id == RELIGN_SERVICE_RUN) {
    using Table = relign_run_service;
    fill(run_, service);
    run_.outer.run = pass<Table, &Table::run, relign_text, relign_text, std::uint32_t, relign_run_outcome*>;
    run_.outer.why = pass<Table, &Table::why, const relign_text_sink*>;
    return &run_.outer;
  }
  if (id == RELIGN_SERVICE_MODEL) {
    using Table = relign_model_service;
    fill(model_, service);
    model_.outer.scene_json = model_.inner->scene_json;
    model_.outer.image_width = model_.inner->image_width;
    model_.outer.image_height = model_.inner->image_height;
    model_.outer.mount = pass<Table, &Table::mount, relign_text, relign_model_lens**>;
    model_.outer.capture =
        pass<Table, &Table::capture, relign_model_lens*, const double*, std::uint32_t, std::uint64_t, float*>;
    model_.outer.noise_free = pass<Table, &Table::noise_free, relign_model_lens*, const double*, std::uint32_t, float*>;
    model_.outer.unmount = pass<Table, &Table::unmount, relign_model_lens*>;
    model_.outer.why = pass<Table, &Table::why, const relign_text_sink*>;
    return &model_.outer;
  }
  if (id == RELIGN_SERVICE_PREPARED) {
    using Table = relign_pretraining_service;
    fill(prepared_, service);
    prepared_.outer.active = prepared_.inner->active;
    prepared_.outer.source = prepared_.inner->source;
    prepared_.outer.sources = prepared_.inner->sources;
    prepared_.outer.load = pass<Table, &Table::load, const relign_text_sink*>;
    prepared_.outer.save = pass<Table, &Table::save, relign_text>;
    prepared_.outer.why = pass<Table, &Table::why, const relign_text_sink*>;
    return &prepared_.outer;
  }
  return nullptr;
}

}  // namespace relign::plugin_host
