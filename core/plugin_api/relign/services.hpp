// relign/services.hpp: what a trial offers besides steps, as C++ classes. Comes with relign/plugin.hpp.
// Made by core/plugin_api/generate.py from services.toml.
//
// All of it is valid during run, in the thread of run. Failures are thrown as std::exception with the host's message;
// services that work for long throw Stopped after the user stopped the run.
// clang-format off
#ifndef RELIGN_SERVICES_HPP
#define RELIGN_SERVICES_HPP

#include <cstdint>
#include <optional>
#include <relign/service.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace relign {

struct FieldMeasure {
  std::string name;  // of the field
  double mark_x_px = 0;  // centre of the field's mark, from the middle of the first column
  double mark_y_px = 0;  // from the middle of the top row
  double tangential = 0;  // MTF, pixel included
  double sagittal = 0;  // MTF, pixel included
};

// "relign.measures/1": measures of the last capture, by name.
class Measures : public border::Service<relign_measures_service> {
 public:
  using Service::Service;

  // The names of all measures. [{"name": "mtf", "summary": "...", "arguments": {"cycles_per_pixel": "...", ...}}, ...];
  // a summary states the unit.
  std::string list() const {
    border::Collector measures;
    check(table_->list(table_->context, measures.sink()), "measures.list");
    return measures.text();
  }
  // One measure of the last capture. NaN when this capture does not allow it (no light, no edge in the region); that is
  // not a failure.
  double measure(std::string_view name, std::string_view arguments_json = {}) const {
    double value = 0;
    check(table_->measure(table_->context, to_text(name), to_text(arguments_json), &value), "measures.measure");
    return value;
  }
  // The slanted edges of the last capture, all fields in the time of one. They have the order of the scene's "fields".
  // arguments: {"cycles_per_pixel": 0.1} or {"lp_per_mm": 50}. NaN: not in this capture.
  std::vector<FieldMeasure> fields(std::string_view arguments_json = {}) const {
    auto fields = empty<relign_field_measures>();
    check(table_->fields(table_->context, to_text(arguments_json), &fields), "measures.fields");
    std::vector<FieldMeasure> rows;
    for (std::uint32_t i = 0; i < fields.count; ++i) rows.push_back({std::string(to_view(fields.name[i])), fields.mark_x_px[i], fields.mark_y_px[i], fields.tangential[i], fields.sagittal[i]});
    return rows;
  }
};

// "relign.regions/1": the next capture reads out some regions only, in less readout time. Inside the regions pixels are
// those of the whole frame, bit for bit; the others are 0. The merit of such a capture is computed from its regions; it
// never counts as the best measured one.
class Regions : public border::Service<relign_regions_service> {
 public:
  using Service::Service;

  // How many regions select accepts.
  std::uint32_t most() const { return table_->most; }
  // Selects what the next capture of this trial reads out. Captures after it are whole frames again. A rectangle has at
  // least one pixel and is inside the image; rectangles may overlap; none: the whole frame. relign.run/1 starts with
  // whole frames. False: the scene captures whole frames only, and nothing is selected.
  bool select(const std::vector<Region>& regions) const {
    return done(table_->select(table_->context, to_numbers(regions).data(), count_of(regions)), "regions.select");
  }
};

// "relign.prior/1": draws from the noise level's distribution. Draws use training seeds: they are never the instance of
// this trial or of any benchmark. A station does not offer it.
class Prior : public border::Service<relign_prior_service> {
 public:
  using Service::Service;

  // Draw `number` of the perturbations. As relign_noise_level_interface::draw writes it: {"start": [...], "distortion":
  // [[...]], "elements": {...}}, and "cure_shift" (of which the batch's mean is a part), "stage" and "batch" where the
  // level draws them. The same number is the same draw in every trial of this level and scene.
  std::string draw(std::uint64_t number) const {
    border::Collector drawn;
    check(table_->draw(table_->context, number, drawn.sink()), "prior.draw");
    return drawn.text();
  }
};

// "relign.history/1": what inspection measured on earlier modules of the batch. The glue of modules from one batch
// cures alike: their shifts have a common mean, which a method can learn from the modules before and aim off by it.
// Measured shifts are a function of the instances alone, whichever method aligned the earlier modules and in whatever
// order trials ran.
class History : public border::Service<relign_history_service> {
 public:
  using Service::Service;

  // Earlier modules of this batch; 0 for its first, on a station, and at a level without batches.
  std::uint32_t modules() const { return table_->modules; }
  // The measured shift of the module `back` places before this one. back: 1 to `modules`. The shift is the true pose
  // after curing minus that before, with the errors of inspection, in fractions of the travel.
  Pose cure_shift(std::uint32_t back) const {
    Pose shift(axes());
    check(table_->cure_shift(table_->context, back, shift.data(), count_of(shift)), "history.cure_shift");
    return shift;
  }
};

// The services as members of Trial. Each throws std::logic_error when the host does not offer it; the message names
// what the manifest lacks.
class TrialServices : public border::TrialTable {
 public:
  using TrialTable::TrialTable;

  Measures measures() const {
    return {*this, offered<relign_measures_service>(RELIGN_SERVICE_MEASURES, RELIGN_OBSERVES_IMAGES, "images")};
  }
  Regions regions() const {
    return {*this, offered<relign_regions_service>(RELIGN_SERVICE_REGIONS, RELIGN_OBSERVES_IMAGES, "images")};
  }
  Prior prior() const {
    return {*this, offered<relign_prior_service>(RELIGN_SERVICE_PRIOR, RELIGN_OBSERVES_LEVEL, "level")};
  }
  History history() const {
    return {*this, offered<relign_history_service>(RELIGN_SERVICE_HISTORY, RELIGN_OBSERVES_HISTORY, "history")};
  }
};

}  // namespace relign

#endif  // RELIGN_SERVICES_HPP
