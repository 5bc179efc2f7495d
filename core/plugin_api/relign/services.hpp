// relign/services.hpp: what a trial offers besides moving and looking, as C++ classes. Comes with
// relign/plugin.hpp; the rules are in the C header of each service, relign/services/.
//
// All of it is valid during run, in the thread of run. Failures are thrown as std::exception with the host's sentence;
// prior and model throw Stopped once the user stopped the run.
#ifndef RELIGN_SERVICES_HPP
#define RELIGN_SERVICES_HPP

#include <relign/plugin.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <relign/trial.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relign {

namespace border {

// Collects what the host writes.
class Collector {
 public:
  Collector() {
    sink_.struct_size = sizeof sink_;
    sink_.context = this;
    sink_.write = [](void* context, relign_text text) {
      auto* self = static_cast<Collector*>(context);
      try {
        self->text_.assign(text.data ? text.data : "", static_cast<std::size_t>(text.size));
      } catch (...) {
        self->text_.clear();  // the host's frames are in between: nothing may be thrown
      }
    };
  }
  Collector(const Collector&) = delete;
  Collector& operator=(const Collector&) = delete;
  const relign_text_sink* sink() const { return &sink_; }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  relign_text_sink sink_{};
};

// Throws what the service says of its last refusal.
template <class Service>
void check_service(const Service* service, relign_status status, const char* what) {
  if (status == RELIGN_OK) return;
  if (status == RELIGN_STOP) throw Stopped();
  Collector sentence;
  service->why(service->context, sentence.sink());
  const std::string text = std::string(what) + ": " + (sentence.text().empty() ? "refused" : sentence.text());
  if (status == RELIGN_BAD_ARGUMENT) throw std::invalid_argument(text);
  throw std::runtime_error(text);
}

}  // namespace border

// A field of the last capture; NaN: not in it.
struct FieldMeasure {
  std::string name;
  double mark_x_px = 0, mark_y_px = 0;
  double tangential = 0, sagittal = 0;  // MTF, pixel included
};

// "relign.measures/1": what the last capture says of its own sharpness.
class Measures {
 public:
  explicit Measures(const relign_measures_service* service) : service_(service) {}

  // JSON: names, summaries and arguments of all measures.
  std::string list() const {
    border::Collector measures;
    border::check_service(service_, service_->list(service_->context, measures.sink()), "measures");
    return measures.text();
  }
  // NaN when this capture does not allow it. arguments_json: R"({"cycles_per_pixel": 0.1})"
  double measure(std::string_view name, std::string_view arguments_json = {}) const {
    double value = 0;
    border::check_service(
        service_, service_->measure(service_->context, to_text(name), to_text(arguments_json), &value), "measure");
    return value;
  }
  // All fields at once, in the time of one of them. arguments_json: R"({"lp_per_mm": 50})", or cycles_per_pixel.
  std::vector<FieldMeasure> fields(std::string_view arguments_json) const {
    relign_field_measures written{};
    written.struct_size = sizeof written;
    border::check_service(service_, service_->fields(service_->context, to_text(arguments_json), &written), "fields");
    std::vector<FieldMeasure> fields;
    for (std::uint32_t i = 0; i < written.count; ++i)
      fields.push_back({std::string(to_view(written.names[i])), written.mark_x_px[i], written.mark_y_px[i],
                        written.tangential[i], written.sagittal[i]});
    return fields;
  }

 private:
  const relign_measures_service* service_;
};

// "relign.prior/1": draws from the noise level's distribution, never of a benchmark instance.
class Prior {
 public:
  explicit Prior(const relign_prior_service* service) : service_(service) {}

  // Draw `number` as JSON: {"start": [...], "distortion": [[...]], "elements": {...}}, and "cure_shift": [...], of
  // which the batch's mean is a part, "stage": {...} and "batch": {...} where the level draws them.
  std::string draw(std::uint64_t number) const {
    border::Collector drawn;
    border::check_service(service_, service_->draw(service_->context, number, drawn.sink()), "prior");
    return drawn.text();
  }

 private:
  const relign_prior_service* service_;
};

// "relign.history/1": what inspection measured on earlier modules of the batch.
class History {
 public:
  History(const relign_history_service* service, std::uint32_t axes) : service_(service), axes_(axes) {}

  // Earlier modules of this batch; 0 for its first, on a station, and at a level without batches.
  std::uint32_t modules() const { return service_->modules; }
  // Measured shift of the module `back` places before this one, from 1: true pose after curing minus that before.
  Pose cure_shift(std::uint32_t back) const {
    Pose shift(axes_);
    border::check_service(service_, service_->cure_shift(service_->context, back, shift.data(), axes_), "history");
    return shift;
  }

 private:
  const relign_history_service* service_;
  std::uint32_t axes_;
};

// A lens of one's own in the model; unmounted by its destructor.
class ModelLens {
 public:
  ModelLens(const relign_model_service* service, relign_model_lens* lens, std::weak_ptr<void> run)
      : service_(service), lens_(lens), run_(std::move(run)) {}
  ModelLens(ModelLens&& other) noexcept
      : service_(other.service_), lens_(std::exchange(other.lens_, nullptr)), run_(std::move(other.run_)) {}
  ModelLens& operator=(ModelLens&& other) noexcept {
    std::swap(service_, other.service_);
    std::swap(lens_, other.lens_);
    std::swap(run_, other.run_);
    return *this;
  }
  ~ModelLens() {
    // After run the host has unmounted it already: an algorithm may have kept it in a member.
    if (lens_ && !run_.expired()) service_->unmount(service_->context, lens_);
  }

  // Pixels row by row, row 0 on top. true_pose: 0..1 per axis, without any stage.
  std::vector<float> capture(const Pose& true_pose, std::uint64_t seed) const {
    std::vector<float> pixels = image();
    border::check_service(
        service_, service_->capture(service_->context, lens_, true_pose.data(), count(true_pose), seed, pixels.data()),
        "model capture");
    return pixels;
  }
  // Nothing when the scene offers no noise-free images.
  std::optional<std::vector<float>> noise_free(const Pose& true_pose) const {
    std::vector<float> pixels = image();
    const relign_status status =
        service_->noise_free(service_->context, lens_, true_pose.data(), count(true_pose), pixels.data());
    if (status == RELIGN_UNSUPPORTED) return std::nullopt;
    border::check_service(service_, status, "model noise_free");
    return pixels;
  }

 private:
  static std::uint32_t count(const Pose& pose) { return static_cast<std::uint32_t>(pose.size()); }
  std::vector<float> image() const {
    return std::vector<float>(std::size_t{service_->image_width} * service_->image_height);
  }
  const relign_model_service* service_;
  relign_model_lens* lens_;
  std::weak_ptr<void> run_;  // expired once run has returned
};

// "relign.model/1": a simulator of the scene's design, with offsets and seeds of one's own.
class Model {
 public:
  Model(const relign_model_service* service, std::weak_ptr<void> run) : service_(service), run_(std::move(run)) {}

  std::string scene_json() const { return std::string(to_view(service_->scene_json)); }
  std::size_t width() const { return service_->image_width; }
  std::size_t height() const { return service_->image_height; }
  // R"({"L2": {"shift_mm": [0.01, 0, 0]}})"; "{}" is the perfect lens.
  ModelLens mount(std::string_view offsets_json) const {
    relign_model_lens* lens = nullptr;
    border::check_service(service_, service_->mount(service_->context, to_text(offsets_json), &lens), "model mount");
    return ModelLens(service_, lens, run_);
  }

 private:
  const relign_model_service* service_;
  std::weak_ptr<void> run_;
};

// "relign.prepared/1": pretraining on source instances, which are never benchmark instances. Not offered to a plugin
// whose manifest lacks "prepare": then there is nothing to load.
class Pretraining {
 public:
  explicit Pretraining(const relign_pretraining_service* service) : service_(service) {}

  // This trial is on a source instance: sample it, and save.
  // On a source instance, where save() is possible.
  bool active() const { return service_ && service_->active != 0; }
  std::uint32_t source() const { return service_ ? service_->source : 0; }
  std::uint32_t sources() const { return service_ ? service_->sources : 0; }

  // In a trial the prepared data, on a source instance what the sources before left. Nothing when there is none; throws
  // when the pretraining failed. The bytes come from a file that anybody may have touched: check them.
  std::optional<std::string> load() const {
    if (!service_) return std::nullopt;
    border::Collector data;
    const relign_status status = service_->load(service_->context, data.sink());
    if (status == RELIGN_UNSUPPORTED) return std::nullopt;
    border::check_service(service_, status, "load prepared data");
    return data.text();
  }
  // Any bytes, in the place of what was there. Only on a source instance.
  void save(std::string_view data) const {
    if (!service_) throw std::logic_error("this host pretrains nothing: ask active() first");
    border::check_service(service_, service_->save(service_->context, to_text(data)), "save prepared data");
  }

 private:
  const relign_pretraining_service* service_;
};

// "relign.regions/1" selects what the next capture reads out.
inline bool select_regions(const relign_regions_service* service, const std::vector<Region>& regions) {
  std::vector<std::uint32_t> values;
  for (const Region& region : regions)
    values.insert(values.end(), {region.column, region.row, region.columns, region.rows});
  const relign_status status =
      service->select(service->context, values.data(), static_cast<std::uint32_t>(regions.size()));
  if (status == RELIGN_UNSUPPORTED) return false;
  border::check_service(service, status, "select regions");
  return true;
}

// What another algorithm did with some of my steps. Poses are mine to use.
struct RunOutcome {
  unsigned steps = 0;                  // used of the budget; 0 when none was left
  bool finished = false;               // it returned before its steps were used up
  std::optional<Observation> last;     // where the stage is now; nothing when no step was left
  std::optional<Observation> best;     // lowest merit; nothing unless "merit" is granted
  std::optional<Pose> recommendation;  // its recommended pose; counts only when I recommend it
};

template <class Service>
const Service* Trial::offered(const char* id, std::uint32_t needed, const char* word) const {
  if (const void* table = service(id)) return static_cast<const Service*>(table);
  const std::string who = std::string("the service ") + id;
  if (needed != 0 && !observes(needed))
    throw std::logic_error(who + " is not granted: declare \"" + word + "\" under \"observes\" in the manifest");
  throw std::logic_error(who + " is not offered by this host or scene");
}

inline ImageView Trial::reference() const {
  return ImageView(
      *offered<relign_reference_service>(RELIGN_SERVICE_REFERENCE, RELIGN_OBSERVES_IMAGES, "images")->image);
}

inline Measures Trial::measures() const {
  return Measures(offered<relign_measures_service>(RELIGN_SERVICE_MEASURES, RELIGN_OBSERVES_IMAGES, "images"));
}

inline Prior Trial::prior() const {
  return Prior(offered<relign_prior_service>(RELIGN_SERVICE_PRIOR, RELIGN_OBSERVES_LEVEL, "level"));
}

inline History Trial::history() const {
  return History(offered<relign_history_service>(RELIGN_SERVICE_HISTORY, RELIGN_OBSERVES_HISTORY, "history"),
                 static_cast<std::uint32_t>(axes()));
}

inline Model Trial::model() const {
  return Model(offered<relign_model_service>(RELIGN_SERVICE_MODEL, RELIGN_OBSERVES_DESIGN, "design"), run_);
}

inline bool Trial::select_regions(const std::vector<Region>& regions) {
  return relign::select_regions(
      offered<relign_regions_service>(RELIGN_SERVICE_REGIONS, RELIGN_OBSERVES_IMAGES, "images"), regions);
}

inline Pretraining Trial::pretraining() const {
  return Pretraining(static_cast<const relign_pretraining_service*>(service(RELIGN_SERVICE_PREPARED)));
}

inline RunOutcome Trial::run(std::string_view parameter, unsigned most_steps, std::string_view parameters_json) {
  const auto* service = static_cast<const relign_run_service*>(this->service(RELIGN_SERVICE_RUN));
  if (!service)
    throw std::logic_error("the service " RELIGN_SERVICE_RUN
                           " is not offered: declare a parameter of type \"algorithm\" in the manifest");
  relign_run_outcome outcome{};
  outcome.struct_size = sizeof outcome;
  const relign_status status =
      service->run(service->context, to_text(parameter), to_text(parameters_json), most_steps, &outcome);
  if (status == RELIGN_STOP) return {};
  border::check_service(service, status, "run");
  RunOutcome told;
  told.steps = outcome.steps;
  told.finished = outcome.end == RELIGN_RUN_FINISHED;
  if (outcome.last) told.last = convert(*outcome.last);
  if (outcome.best) told.best = convert(*outcome.best);
  if (outcome.recommendation) told.recommendation = Pose(outcome.recommendation, outcome.recommendation + axes());
  return told;
}

}  // namespace relign

#endif  // RELIGN_SERVICES_HPP
