#include "conformance/fake_services.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/error.h"
#include "base/json_source.h"
#include "base/text.h"
#include "conformance/synthetic.h"
#include "trials/instance.h"
#include "trials/measure_table.h"

namespace relign::conformance {
namespace {

constexpr std::size_t kMaxLenses = 16;  // as in the host
constexpr double kStride = 0.02;        // of the walk

std::string text_of(relign_text text) {
  return text.data ? std::string(text.data, static_cast<std::size_t>(text.size)) : std::string();
}

relign_status write_text(const relign_text_sink* sink, const std::string& text) {
  if (!sink || !sink->write) return RELIGN_BAD_ARGUMENT;
  sink->write(sink->context, {text.data(), text.size()});
  return RELIGN_OK;
}

// The sum of all numbers in offsets, which is enough to change the image.
double sum_of_numbers(const Json& value) {
  if (value.is_number()) return std::fabs(value.get<double>());
  double sum = 0;
  if (value.is_structured())
    for (const Json& part : value) sum += sum_of_numbers(part);
  return sum;
}

}  // namespace

FakeServices::FakeServices(const plugin_host::Choice& choice, FakeTrial& trial)
    : choice_(choice), trial_(trial), scene_(trials::read_scene_facts(synthetic_scene(trial.setup.axes), "synthetic")) {
  trial_.setup.service = [this](std::string_view id) { return get(id); };
}

FakeServices::~FakeServices() { trial_.setup.service = nullptr; }

// Runs the body of one function; `why` gets the message of an Error.
template <class Body>
relign_status FakeServices::answer(Body&& body) {
  why_.clear();
  try {
    return body();
  } catch (const Error& error) {
    return refuse(error.what());
  }
}

relign_status FakeServices::refuse(const std::string& sentence) {
  why_ = sentence;
  return RELIGN_BAD_ARGUMENT;
}

relign_status FakeServices::tell_why(void* context, const relign_text_sink* sentence) {
  return write_text(sentence, self(context).why_);
}

const void* FakeServices::get(std::string_view id) {
  const std::uint32_t observes = trial_.setup.observes;
  if (id == RELIGN_SERVICE_REFERENCE && observes & RELIGN_OBSERVES_IMAGES) return reference();
  if (id == RELIGN_SERVICE_MEASURES && observes & RELIGN_OBSERVES_IMAGES) return measures();
  if (id == RELIGN_SERVICE_PRIOR && observes & RELIGN_OBSERVES_LEVEL) return prior();
  if (id == RELIGN_SERVICE_HISTORY && observes & RELIGN_OBSERVES_HISTORY) return history();
  if (id == RELIGN_SERVICE_MODEL && observes & RELIGN_OBSERVES_DESIGN) return model();
  if (id == RELIGN_SERVICE_PREPARED && trial_.setup.pretraining) return prepared();
  if (id == RELIGN_SERVICE_RUN && !choice_.algorithms.empty()) return run();
  return nullptr;
}

void FakeServices::look() {
  if (trial_.last().struct_size != 0) return;
  relign_observation seen{};
  seen.struct_size = sizeof seen;
  trial_.handle().first(trial_.handle().context, &seen);
}

const void* FakeServices::reference() {
  look();
  const FakeSetup& setup = trial_.setup;
  reference_pixels_.assign(std::size_t{setup.image_side} * setup.image_side, 0.0F);
  if (setup.paint) setup.paint(0, reference_pixels_.data());
  reference_image_ = trial_.last_image();
  reference_image_.pixels = reference_pixels_.data();
  reference_.struct_size = sizeof reference_;
  reference_.image = &reference_image_;
  return &reference_;
}

const void* FakeServices::measures() {
  measures_.struct_size = sizeof measures_;
  measures_.context = this;
  measures_.list = [](void* context, const relign_text_sink* sink) {
    return self(context).answer([&] { return write_text(sink, trials::list_measures().dump()); });
  };
  measures_.measure = [](void* context, relign_text name, relign_text arguments_json, double* value) {
    FakeServices& services = self(context);
    return services.answer([&]() -> relign_status {
      if (!value) return services.refuse("'value' is null");
      services.reference();  // also makes sure that there is a capture
      const relign_image &seen = services.trial_.last_image(), &wanted = services.reference_image_;
      *value = trials::measure({seen.pixels, seen.width, seen.height}, {wanted.pixels, wanted.width, wanted.height},
                               services.scene_, text_of(name), text_of(arguments_json));
      return RELIGN_OK;
    });
  };
  measures_.why = tell_why;
  measures_.fields = [](void* context, relign_text arguments_json, relign_field_measures* fields) {
    FakeServices& services = self(context);
    return services.answer([&] {
      services.reference();
      const relign_image& seen = services.trial_.last_image();
      services.fields_ = {{seen.pixels, seen.width, seen.height}, services.scene_, text_of(arguments_json)};
      services.fields_.write(fields);
      return RELIGN_OK;
    });
  };
  return &measures_;
}

std::string FakeServices::draw(std::uint64_t number) const {
  Random random(number, 1);
  Json start = Json::array(), rows = Json::array();
  for (std::uint32_t row = 0; row < trial_.setup.axes; ++row) {
    start.push_back(0.3 + 0.4 * random.uniform());
    Json values = Json::array();
    for (std::uint32_t column = 0; column < trial_.setup.axes; ++column)
      values.push_back((row == column ? 1.0 : 0.0) + 0.05 * (random.uniform() - 0.5));
    rows.push_back(std::move(values));
  }
  const double shift_mm = 0.01 * random.normal();
  Json drawn = {{"start", start},
                {"distortion", rows},
                {"elements", {{"L4", {{"shift_mm", {shift_mm, 0, 0}}, {"tilt_deg", {0, shift_mm}}}}}}};
  if (number % 2 == 1) drawn["stage"] = {{"backlash", std::vector<double>(trial_.setup.axes, 0.001)}};
  return canonical_json(drawn);
}

const void* FakeServices::prior() {
  prior_.struct_size = sizeof prior_;
  prior_.context = this;
  prior_.draw = [](void* context, std::uint64_t number, const relign_text_sink* drawn) {
    FakeServices& services = self(context);
    return services.answer([&] { return write_text(drawn, services.draw(number)); });
  };
  prior_.why = tell_why;
  return &prior_;
}

// Of half of the trials, so that a plugin meets the first module of a batch, too.
const void* FakeServices::history() {
  history_.struct_size = sizeof history_;
  history_.modules = trial_.setup.seed % 2 == 0 ? 3 : 0;
  history_.context = this;
  history_.cure_shift = [](void* context, std::uint32_t back, double* shift, std::uint32_t axes) {
    FakeServices& services = self(context);
    return services.answer([&]() -> relign_status {
      if (!shift || axes != services.trial_.setup.axes) return services.refuse("expected room for one number per axis");
      if (back < 1 || back > services.history_.modules) return services.refuse("the batch has no such module");
      Random random(back, 2);
      std::generate(shift, shift + axes, [&random] { return 0.01 * random.normal(); });
      return RELIGN_OK;
    });
  };
  history_.why = tell_why;
  return &history_;
}

const void* FakeServices::run() {
  run_.struct_size = sizeof run_;
  run_.context = this;
  run_.run = [](void* context, relign_text parameter, relign_text parameters_json, std::uint32_t most_steps,
                relign_run_outcome* outcome) {
    FakeServices& services = self(context);
    return services.answer([&] { return services.walk(parameter, parameters_json, most_steps, outcome); });
  };
  run_.why = tell_why;
  return &run_;
}

// Replaces the algorithm that the parameter names: moves up and down each axis, then returns. So a caller meets both
// ends of relign.run/1.
relign_status FakeServices::walk(relign_text parameter, relign_text parameters_json, std::uint32_t most_steps,
                                 relign_run_outcome* outcome) {
  const std::string name = text_of(parameter), changes = text_of(parameters_json);
  const bool known = std::any_of(choice_.algorithms.begin(), choice_.algorithms.end(), [&](const auto& entry) {
    return normalised_name(entry.first) == normalised_name(name);
  });
  if (!outcome || outcome->struct_size < offsetof(relign_run_outcome, recommendation) + sizeof(const double*))
    return refuse("'outcome' is null or its struct_size too small");
  if (!known) return refuse("'" + choice_.plugin->id + "' has no parameter '" + name + "' of type algorithm");
  if (most_steps == 0) return refuse("expected at least 1 step, found 0");
  if (!changes.empty() && !JsonSource::from_text(changes, "parameters").root().is_object())
    return refuse("expected an object of parameters");
  look();
  const relign_trial& trial = trial_.handle();
  const std::uint32_t axes = trial_.setup.axes;
  const auto remember = [&] {
    best_ = trial_.last();
    best_pose_.assign(best_.pose, best_.pose + axes);
  };
  remember();
  const auto left = static_cast<std::uint32_t>(trial_.setup.budget - trial_.steps.size());
  const std::uint32_t own_end = 2 * axes;
  const std::uint32_t steps = std::min({most_steps, std::max(1U, left), own_end});
  for (std::uint32_t step = 0; step < steps; ++step) {
    const std::uint32_t axis = step / 2 % axes;
    const FakeSetup& setup = trial_.setup;
    Pose pose(trial_.last().pose, trial_.last().pose + axes);
    pose[axis] += step % 2 ? -kStride : kStride;
    pose[axis] = std::max(setup.lower[axis], std::min(setup.upper[axis], pose[axis]));
    relign_observation seen{};
    seen.struct_size = sizeof seen;
    if (trial.step(trial.context, pose.data(), axes, &seen) != RELIGN_OK) return RELIGN_STOP;  // no steps left
    if (seen.merit < best_.merit) remember();
  }
  last_ = trial_.last();
  best_.pose = best_pose_.data();
  if (best_.step != last_.step) best_.image = nullptr;
  recommendation_ = best_pose_;
  relign_run_outcome told{};
  told.struct_size = std::min<std::uint32_t>(outcome->struct_size, sizeof told);
  told.steps = steps;
  told.end = steps == own_end && steps < std::min(most_steps, left) ? RELIGN_RUN_FINISHED : RELIGN_RUN_STEPS_SPENT;
  told.last = &last_;
  told.best = trial_.setup.observes & RELIGN_OBSERVES_MERIT ? &best_ : nullptr;
  told.recommendation = recommendation_.data();
  std::memcpy(outcome, &told, told.struct_size);
  return RELIGN_OK;
}

relign_status FakeServices::picture(relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                    float* pixels) {
  const auto found = std::find_if(lenses_.begin(), lenses_.end(),
                                  [&](const Lens& known) { return static_cast<const void*>(&known) == lens; });
  if (found == lenses_.end()) return refuse("this lens is not mounted");
  if (!true_pose || axes != trial_.setup.axes ||
      !std::all_of(true_pose, true_pose + axes, [](double value) { return std::isfinite(value); }))
    return refuse("invalid pose; expected one finite number per axis");
  if (!pixels) return refuse("'pixels' is null");
  double blur = found->blur;
  for (std::uint32_t axis = 0; axis < axes; ++axis) blur += (true_pose[axis] - 0.5) * (true_pose[axis] - 0.5);
  paint_edge(blur, pixels);
  return RELIGN_OK;
}

const void* FakeServices::prepared() {
  const FakePretraining& pretraining = *trial_.setup.pretraining;
  prepared_.struct_size = sizeof prepared_;
  prepared_.context = this;
  prepared_.active = pretraining.active ? 1 : 0;
  prepared_.source = pretraining.active ? pretraining.source : 0;
  prepared_.sources = pretraining.active ? pretraining.sources : 0;
  prepared_.load = [](void* context, const relign_text_sink* data) {
    FakeServices& services = self(context);
    services.why_ = "no pretrained data";
    const std::optional<std::string>& bytes = services.trial_.setup.pretraining->bytes;
    return bytes ? write_text(data, *bytes) : RELIGN_UNSUPPORTED;
  };
  prepared_.save = [](void* context, relign_text data) {
    FakeServices& services = self(context);
    FakePretraining& kept = *services.trial_.setup.pretraining;
    if (!kept.active) return services.refuse("cannot save in a benchmark trial, only in pretraining");
    kept.bytes = text_of(data);
    return relign_status{RELIGN_OK};
  };
  prepared_.why = tell_why;
  return &prepared_;
}

const void* FakeServices::model() {
  model_.struct_size = sizeof model_;
  model_.context = this;
  model_.scene_json = {scene_.text.data(), scene_.text.size()};
  model_.image_width = kPictureSide;
  model_.image_height = kPictureSide;
  model_.mount = [](void* context, relign_text offsets_json, relign_model_lens** made) {
    FakeServices& services = self(context);
    return services.answer([&]() -> relign_status {
      if (!made) return services.refuse("'made' is null");
      if (services.lenses_.size() >= kMaxLenses)
        return services.refuse("16 lenses are mounted, the maximum; unmount one of them first");
      const Json offsets = valid_json(trials::read_offsets(text_of(offsets_json), services.scene_));
      services.lenses_.push_back({sum_of_numbers(offsets)});
      *made = reinterpret_cast<relign_model_lens*>(&services.lenses_.back());
      return RELIGN_OK;
    });
  };
  model_.capture = [](void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                      std::uint64_t seed, float* pixels) {
    FakeServices& services = self(context);
    return services.answer([&] {
      const relign_status status = services.picture(lens, true_pose, axes, pixels);
      Random random(seed, 2);
      for (std::size_t i = 0; status == RELIGN_OK && i < std::size_t{kPictureSide} * kPictureSide; ++i)
        pixels[i] += static_cast<float>(0.01 * random.normal());
      return status;
    });
  };
  model_.noise_free = [](void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                         float* pixels) {
    FakeServices& services = self(context);
    return services.answer([&] { return services.picture(lens, true_pose, axes, pixels); });
  };
  model_.unmount = [](void* context, relign_model_lens* lens) {
    FakeServices& services = self(context);
    return services.answer([&]() -> relign_status {
      const auto found = std::find_if(services.lenses_.begin(), services.lenses_.end(),
                                      [&](const Lens& known) { return static_cast<const void*>(&known) == lens; });
      if (found == services.lenses_.end()) return services.refuse("this lens is not mounted");
      services.lenses_.erase(found);
      return RELIGN_OK;
    });
  };
  model_.why = tell_why;
  return &model_;
}

}  // namespace relign::conformance
