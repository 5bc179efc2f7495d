#include "conformance/fake_services.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <list>

#include "base/error.h"
#include "base/json_source.h"
#include "base/text.h"
#include "conformance/synthetic.h"
#include "plugin_host/service_tables.h"
#include "trials/instance.h"
#include "trials/measure_table.h"
#include "trials/scene_facts.h"

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

struct Lens {
  double blur;                         // of its offsets
  std::vector<float> last_image = {};  // of capture and noise_free
};

}  // namespace

struct FakeServices::State {
  State(const plugin_host::Choice& of, FakeTrial& in)
      : choice(of), trial(in), scene(trials::read_scene_facts(synthetic_scene(in.setup.axes), "synthetic")) {}

  bool grants(std::uint32_t bits) const { return (trial.setup.observes & bits) == bits; }
  relign_status refuse(const std::string& reason) {
    why = reason;
    return RELIGN_BAD_ARGUMENT;
  }
  void look();  // takes the first capture, unless there is one
  const relign_image& reference();
  std::string draw(std::uint64_t number) const;
  relign_status walk(relign_text parameter, relign_text parameters_json, std::uint32_t most_steps,
                     relign_run_outcome* outcome);
  std::list<Lens>::iterator find(relign_model_lens* lens) {
    return std::find_if(lenses.begin(), lenses.end(),
                        [&](const Lens& known) { return static_cast<const void*>(&known) == lens; });
  }
  void keep(relign_model_lens* lens, const float* pixels) {
    find(lens)->last_image.assign(pixels, pixels + std::size_t{kPictureSide} * kPictureSide);
  }
  relign_status check(relign_model_lens* lens, const double* true_pose, std::uint32_t axes);
  relign_status picture(relign_model_lens* lens, const double* true_pose, std::uint32_t axes, float* pixels,
                        double more_blur = 0);
  relign_status slopes(relign_model_lens* lens, const double* true_pose, std::uint32_t axes, std::uint32_t elements,
                       float* pixels);

  const plugin_host::Choice& choice;
  FakeTrial& trial;
  trials::SceneFacts scene;
  std::string why;
  plugin_host::ServiceTables tables;
  std::vector<float> reference_pixels;
  relign_image reference_image{};
  trials::FieldMeasures fields;
  std::list<Lens> lenses;  // a list, because the addresses are the handles
  // What the last outcome points to.
  relign_observation last{};
  relign_observation best{};
  Pose best_pose;
  Pose recommendation;
};

namespace {

using State = FakeServices::State;

// Runs the body of one function, body(State&); `why` gets the message of an Error.
template <class Body>
relign_status answer(void* context, Body&& body) {
  State& state = *static_cast<State*>(context);
  state.why.clear();
  try {
    return body(state);
  } catch (const Error& error) {
    return state.refuse(error.what());
  }
}

images::View view_of(const relign_image& image) { return {image.pixels, image.width, image.height}; }

// Each service: fills its table and returns whether the algorithm gets it.
bool offer(State& state, relign_reference_service& table) {
  if (!state.grants(RELIGN_OBSERVES_IMAGES)) return false;
  table.image = &state.reference();
  return true;
}

bool offer(State& state, relign_measures_service& table) {
  table.list = [](void* context, const relign_text_sink* sink) {
    return answer(context, [&](State&) { return write_text(sink, trials::list_measures().dump()); });
  };
  table.measure = [](void* context, relign_text name, relign_text arguments_json, double* value) {
    return answer(context, [&](State& now) -> relign_status {
      if (!value) return now.refuse("'value' is null");
      const relign_image& wanted = now.reference();  // also makes sure that there is a capture
      *value = trials::measure(view_of(now.trial.last_image()), view_of(wanted), now.scene, text_of(name),
                               text_of(arguments_json));
      return RELIGN_OK;
    });
  };
  table.fields = [](void* context, relign_text arguments_json, relign_field_measures* fields) {
    return answer(context, [&](State& now) -> relign_status {
      now.look();
      now.fields = {view_of(now.trial.last_image()), now.scene, text_of(arguments_json)};
      now.fields.write(fields);
      return RELIGN_OK;
    });
  };
  return state.grants(RELIGN_OBSERVES_IMAGES);
}

// As for a scene that captures whole frames only.
bool offer(State& state, relign_regions_service& table) {
  table.select = [](void* context, const std::uint32_t*, std::uint32_t) {
    return answer(context, [](State& now) -> relign_status {
      now.why = "the scene captures whole frames only";
      return RELIGN_UNSUPPORTED;
    });
  };
  return state.grants(RELIGN_OBSERVES_IMAGES);
}

bool offer(State& state, relign_prior_service& table) {
  table.draw = [](void* context, std::uint64_t number, const relign_text_sink* drawn) {
    return answer(context, [&](State& now) { return write_text(drawn, now.draw(number)); });
  };
  return state.grants(RELIGN_OBSERVES_LEVEL);
}

// Of half of the trials, so that a plugin meets the first module of a batch, too.
bool offer(State& state, relign_history_service& table) {
  table.modules = state.trial.setup.seed % 2 == 0 ? 3 : 0;
  table.cure_shift = [](void* context, std::uint32_t back, double* shift, std::uint32_t axes) {
    return answer(context, [&](State& now) -> relign_status {
      if (!shift || axes != now.trial.setup.axes) return now.refuse("expected room for one number per axis");
      if (back < 1 || back > now.tables.history.modules) return now.refuse("the batch has no such module");
      Random random(back, 2);
      std::generate(shift, shift + axes, [&random] { return 0.01 * random.normal(); });
      return RELIGN_OK;
    });
  };
  return state.grants(RELIGN_OBSERVES_HISTORY);
}

bool offer(State& state, relign_run_service& table) {
  table.run = [](void* context, relign_text parameter, relign_text parameters_json, std::uint32_t most_steps,
                 relign_run_outcome* outcome) {
    return answer(context, [&](State& now) { return now.walk(parameter, parameters_json, most_steps, outcome); });
  };
  return !state.choice.algorithms.empty();
}

bool offer(State& state, relign_prepared_service& table) {
  const FakePretraining* pretraining = state.trial.setup.pretraining;
  if (!pretraining) return false;
  table.active = pretraining->active ? 1 : 0;
  table.source = pretraining->active ? pretraining->source : 0;
  table.sources = pretraining->active ? pretraining->sources : 0;
  table.load = [](void* context, const relign_text_sink* data) {
    return answer(context, [&](State& now) {
      now.why = "no pretrained data";
      const std::optional<std::string>& bytes = now.trial.setup.pretraining->bytes;
      return bytes ? write_text(data, *bytes) : RELIGN_UNSUPPORTED;
    });
  };
  table.save = [](void* context, relign_text data) {
    return answer(context, [&](State& now) -> relign_status {
      FakePretraining& kept = *now.trial.setup.pretraining;
      if (!kept.active) return now.refuse("cannot save in a benchmark trial, only in pretraining");
      kept.bytes = text_of(data);
      return RELIGN_OK;
    });
  };
  return true;
}

bool offer(State& state, relign_model_service& table) {
  table.scene_json = {state.scene.text.data(), state.scene.text.size()};
  table.image_width = kPictureSide;
  table.image_height = kPictureSide;
  table.mount = [](void* context, relign_text offsets_json, relign_model_lens** made) {
    return answer(context, [&](State& now) -> relign_status {
      if (!made) return now.refuse("'made' is null");
      if (now.lenses.size() >= kMaxLenses)
        return now.refuse("16 lenses are mounted, the maximum; unmount one of them first");
      const Json offsets = valid_json(trials::read_offsets(text_of(offsets_json), now.scene));
      now.lenses.push_back({sum_of_numbers(offsets)});
      *made = reinterpret_cast<relign_model_lens*>(&now.lenses.back());
      return RELIGN_OK;
    });
  };
  table.capture = [](void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                     std::uint64_t seed, float* pixels) {
    return answer(context, [&](State& now) {
      const relign_status status = now.picture(lens, true_pose, axes, pixels);
      Random random(seed, 2);
      for (std::size_t i = 0; status == RELIGN_OK && i < std::size_t{kPictureSide} * kPictureSide; ++i)
        pixels[i] += static_cast<float>(0.01 * random.normal());
      if (status == RELIGN_OK) now.keep(lens, pixels);
      return status;
    });
  };
  table.noise_free = [](void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                        float* pixels) {
    return answer(context, [&](State& now) {
      const relign_status status = now.picture(lens, true_pose, axes, pixels);
      if (status == RELIGN_OK) now.keep(lens, pixels);
      return status;
    });
  };
  table.slopes = [](void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes, std::uint64_t,
                    std::uint32_t samples, const std::uint32_t* elements, std::uint32_t count, float* pixels) {
    return answer(context, [&](State& now) -> relign_status {
      if (samples == 0) return now.refuse("expected at least 1 sample per pixel, found 0");
      const std::set<std::uint32_t> once(elements, elements + count);
      if (once.size() < count || (count > 0 && *once.rbegin() >= now.scene.elements.size()))
        return now.refuse("expected different elements, as numbers below " + std::to_string(now.scene.elements.size()));
      return now.slopes(lens, true_pose, axes, count, pixels);
    });
  };
  table.fields = [](void* context, relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                    relign_text arguments_json, relign_model_fields*) {
    return answer(context, [&](State& now) -> relign_status {
      if (const relign_status status = now.check(lens, true_pose, axes); status != RELIGN_OK) return status;
      trials::cycles_per_pixel_of(now.scene, text_of(arguments_json));
      now.why = "the scene measures no MTF of its fields";
      return RELIGN_UNSUPPORTED;
    });
  };
  table.measure = [](void* context, relign_model_lens* lens, relign_text name, relign_text arguments_json,
                     double* value) {
    return answer(context, [&](State& now) -> relign_status {
      const auto found = now.find(lens);
      if (found == now.lenses.end() || found->last_image.empty())
        return now.refuse(found == now.lenses.end() ? "this lens is not mounted" : "no image was made of this lens");
      if (!value) return now.refuse("'value' is null");
      const relign_image& wanted = now.reference();
      *value = trials::measure({found->last_image.data(), kPictureSide, kPictureSide}, view_of(wanted), now.scene,
                               text_of(name), text_of(arguments_json));
      return RELIGN_OK;
    });
  };
  table.unmount = [](void* context, relign_model_lens* lens) {
    return answer(context, [&](State& now) -> relign_status {
      const auto found = now.find(lens);
      if (found == now.lenses.end()) return now.refuse("this lens is not mounted");
      now.lenses.erase(found);
      return RELIGN_OK;
    });
  };
  return state.grants(RELIGN_OBSERVES_DESIGN);
}

}  // namespace

FakeServices::FakeServices(const plugin_host::Choice& choice, FakeTrial& trial)
    : state_(std::make_unique<State>(choice, trial)) {
  trial.setup.service = [this](std::string_view id) {
    return plugin_host::find_service(state_->tables, id, [&](auto& table) {
      table.struct_size = sizeof table;
      table.context = state_.get();
      return offer(*state_, table);
    });
  };
  trial.setup.why = [this] { return state_->why; };
}

FakeServices::~FakeServices() {
  state_->trial.setup.service = nullptr;
  state_->trial.setup.why = nullptr;
}

void FakeServices::State::look() {
  if (trial.last().struct_size != 0) return;
  relign_observation seen{};
  seen.struct_size = sizeof seen;
  trial.handle().first(trial.handle().context, &seen);
}

const relign_image& FakeServices::State::reference() {
  look();
  const FakeSetup& setup = trial.setup;
  reference_pixels = setup.reference;
  if (reference_pixels.empty()) {
    reference_pixels.assign(std::size_t{setup.image_side} * setup.image_height, 0.0F);
    if (setup.paint) setup.paint(0, reference_pixels.data());
  }
  reference_image = trial.last_image();
  reference_image.pixels = reference_pixels.data();
  return reference_image;
}

std::string FakeServices::State::draw(std::uint64_t number) const {
  Random random(number, 1);
  Json start = Json::array(), rows = Json::array();
  for (std::uint32_t row = 0; row < trial.setup.axes; ++row) {
    start.push_back(0.3 + 0.4 * random.uniform());
    Json values = Json::array();
    for (std::uint32_t column = 0; column < trial.setup.axes; ++column)
      values.push_back((row == column ? 1.0 : 0.0) + 0.05 * (random.uniform() - 0.5));
    rows.push_back(std::move(values));
  }
  const double shift_mm = 0.01 * random.normal();
  Json drawn = {{"start", start},
                {"distortion", rows},
                {"elements", {{"L4", {{"shift_mm", {shift_mm, 0, 0}}, {"tilt_deg", {0, shift_mm}}}}}}};
  if (number % 2 == 1) drawn["stage"] = {{"backlash", std::vector<double>(trial.setup.axes, 0.001)}};
  return canonical_json(drawn);
}

// Replaces the algorithm that the parameter names: moves up and down each axis, then returns. So a caller meets both
// ends of relign.run/1.
relign_status FakeServices::State::walk(relign_text parameter, relign_text parameters_json, std::uint32_t most_steps,
                                        relign_run_outcome* outcome) {
  const std::string name = text_of(parameter), changes = text_of(parameters_json);
  const bool known = std::any_of(choice.algorithms.begin(), choice.algorithms.end(), [&](const auto& entry) {
    return normalised_name(entry.first) == normalised_name(name);
  });
  if (!outcome || outcome->struct_size < offsetof(relign_run_outcome, recommendation) + sizeof(const double*))
    return refuse("'outcome' is null or its struct_size too small");
  if (!known) return refuse("'" + choice.plugin->id + "' has no parameter '" + name + "' of type algorithm");
  if (most_steps == 0) return refuse("expected at least 1 step, found 0");
  if (!changes.empty() && !JsonSource::from_text(changes, "parameters").root().is_object())
    return refuse("expected an object of parameters");
  look();
  const relign_trial& table = trial.handle();
  const std::uint32_t axes = trial.setup.axes;
  const auto remember = [&] {
    best = trial.last();
    best_pose.assign(best.pose, best.pose + axes);
  };
  remember();
  const auto left = static_cast<std::uint32_t>(trial.setup.budget - trial.steps.size());
  const std::uint32_t own_end = 2 * axes;
  const std::uint32_t steps = std::min({most_steps, std::max(1U, left), own_end});
  for (std::uint32_t step = 0; step < steps; ++step) {
    const std::uint32_t axis = step / 2 % axes;
    const FakeSetup& setup = trial.setup;
    Pose pose(trial.last().pose, trial.last().pose + axes);
    pose[axis] += step % 2 ? -kStride : kStride;
    pose[axis] = std::max(setup.lower[axis], std::min(setup.upper[axis], pose[axis]));
    relign_observation seen{};
    seen.struct_size = sizeof seen;
    if (table.step(table.context, pose.data(), axes, &seen) != RELIGN_OK) return RELIGN_STOP;  // no steps left
    if (seen.merit < best.merit) remember();
  }
  last = trial.last();
  best.pose = best_pose.data();
  if (best.step != last.step) best.image = nullptr;
  recommendation = best_pose;
  relign_run_outcome told{};
  told.struct_size = std::min<std::uint32_t>(outcome->struct_size, sizeof told);
  told.steps = steps;
  told.end = steps == own_end && steps < std::min(most_steps, left) ? RELIGN_RUN_FINISHED : RELIGN_RUN_STEPS_SPENT;
  told.last = &last;
  told.best = trial.setup.observes & RELIGN_OBSERVES_MERIT ? &best : nullptr;
  told.recommendation = recommendation.data();
  std::memcpy(outcome, &told, told.struct_size);
  return RELIGN_OK;
}

relign_status FakeServices::State::check(relign_model_lens* lens, const double* true_pose, std::uint32_t axes) {
  if (find(lens) == lenses.end()) return refuse("this lens is not mounted");
  if (!true_pose || axes != trial.setup.axes ||
      !std::all_of(true_pose, true_pose + axes, [](double value) { return std::isfinite(value); }))
    return refuse("invalid pose; expected one finite number per axis");
  return RELIGN_OK;
}

relign_status FakeServices::State::picture(relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                           float* pixels, double more_blur) {
  if (const relign_status status = check(lens, true_pose, axes); status != RELIGN_OK) return status;
  if (!pixels) return refuse("'pixels' is null");
  double blur = find(lens)->blur + more_blur;
  for (std::uint32_t axis = 0; axis < axes; ++axis) blur += (true_pose[axis] - 0.5) * (true_pose[axis] - 0.5);
  paint_edge(blur, pixels);
  return RELIGN_OK;
}

// By differences. Offsets only blur, all alike.
relign_status FakeServices::State::slopes(relign_model_lens* lens, const double* true_pose, std::uint32_t axes,
                                          std::uint32_t elements, float* pixels) {
  constexpr std::size_t kPixels = std::size_t{kPictureSide} * kPictureSide;
  constexpr double kStride = 0.01;
  if (const relign_status status = picture(lens, true_pose, axes, pixels); status != RELIGN_OK) return status;
  std::vector<float> ahead(kPixels), behind(kPixels);
  for (std::uint32_t number = 0; number < axes + 5 * elements; ++number) {
    for (const double side : {-1.0, 1.0}) {
      Pose pose(true_pose, true_pose + axes);
      if (number < axes) pose[number] += side * kStride;
      picture(lens, pose.data(), axes, (side > 0 ? ahead : behind).data(), number < axes ? 0 : side * kStride);
    }
    for (std::size_t i = 0; i < kPixels; ++i)
      pixels[(number + 1) * kPixels + i] = (ahead[i] - behind[i]) / static_cast<float>(2 * kStride);
  }
  return RELIGN_OK;
}

}  // namespace relign::conformance
