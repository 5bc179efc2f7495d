// environment::Batch with buffers. Calls that render release the GIL.
#include "environment/batch.h"

#include <algorithm>

#include "base/error.h"
#include "bindings.h"

namespace relign::python {
namespace {

using environment::Batch;
using Slots = std::vector<unsigned>;

SeedDomain domain_of(const std::string& name) {
  if (name == "training") return SeedDomain::training;
  if (name == "tuning") return SeedDomain::tuning;
  if (name == "benchmark") return SeedDomain::benchmark;
  throw Error(ErrorKind::bad_input, "unknown instances '" + name + "'; instances: training, tuning, benchmark");
}

std::unique_ptr<Batch> make_batch(plugin_host::Catalog& catalog, const std::string& scene,
                                  const std::string& scene_parameters, const std::string& level,
                                  const std::string& level_parameters, const std::string& clipping,
                                  std::uint64_t suite_seed, unsigned slots, unsigned threads,
                                  const std::string& cache_folder, const std::string& device) {
  if (device != "cpu" && device != "cuda")
    throw Error(ErrorKind::bad_input, "unknown device '" + device + "'; devices: cpu, cuda");
  environment::BatchSetup setup;
  setup.on_gpu = device == "cuda";
  setup.scene = choose(catalog, plugin_host::Kind::scene, scene, scene_parameters);
  setup.level = choose(catalog, plugin_host::Kind::noise_level, level, level_parameters);
  setup.limits = limits_of(clipping);
  setup.suite_seed = suite_seed;
  setup.slots = slots;
  setup.threads = threads;
  setup.cache_folder = cache_folder;
  const py::gil_scoped_release release;
  return std::make_unique<Batch>(std::move(setup));
}

void reset(Batch& batch, const Slots& slots, const std::string& domain, const std::vector<std::uint64_t>& numbers) {
  if (numbers.size() != slots.size()) throw Error(ErrorKind::bad_input, "reset needs one instance number per slot");
  std::vector<Batch::Draw> draws;
  for (std::size_t k = 0; k < slots.size(); ++k) draws.push_back({slots[k], domain_of(domain), numbers[k]});
  const py::gil_scoped_release release;
  batch.reset(draws);
}

void move_by(Batch& batch, const Slots& slots, const py::buffer& moves) {
  const double* numbers = numbers_of<double>(moves, {slots.size(), batch.facts().axes.size()}, false, "moves");
  const py::gil_scoped_release release;
  batch.move_by(slots, numbers);
}

void capture_at(Batch& batch, const Slots& slots, const py::buffer& poses, const std::vector<std::uint64_t>& seeds,
                const py::buffer& frames) {
  const double* numbers = numbers_of<double>(poses, {slots.size(), batch.facts().axes.size()}, false, "poses");
  if (seeds.size() != slots.size()) throw Error(ErrorKind::bad_input, "capture_at needs one seed per slot");
  float* pixels =
      numbers_of<float>(frames, {slots.size(), batch.facts().image_height, batch.facts().image_width}, true, "frames");
  const py::gil_scoped_release release;
  batch.capture_at(slots, numbers, seeds.data(), pixels);
}

// `frames`: the address of as many float32 in the GPU's memory.
void capture_into(Batch& batch, const Slots& slots, const py::buffer& poses, const std::vector<std::uint64_t>& seeds,
                  std::uintptr_t frames) {
  const double* numbers = numbers_of<double>(poses, {slots.size(), batch.facts().axes.size()}, false, "poses");
  if (seeds.size() != slots.size()) throw Error(ErrorKind::bad_input, "capture_into needs one seed per slot");
  const py::gil_scoped_release release;
  batch.capture_at(slots, numbers, seeds.data(), reinterpret_cast<float*>(frames));
}

void render_at(Batch& batch, const Slots& slots, const py::buffer& poses, const py::buffer& frames) {
  const double* numbers = numbers_of<double>(poses, {slots.size(), batch.facts().axes.size()}, false, "poses");
  float* pixels =
      numbers_of<float>(frames, {slots.size(), batch.facts().image_height, batch.facts().image_width}, true, "frames");
  const py::gil_scoped_release release;
  batch.render_at(slots, numbers, pixels);
}

void render_slopes_at(Batch& batch, const Slots& slots, const py::buffer& poses,
                      const std::vector<std::uint64_t>& seeds, std::uint32_t samples, const py::buffer& images) {
  const trials::SceneFacts& facts = batch.facts();
  const double* numbers = numbers_of<double>(poses, {slots.size(), facts.axes.size()}, false, "poses");
  if (seeds.size() != slots.size()) throw Error(ErrorKind::bad_input, "render_slopes_at needs one seed per slot");
  float* pixels = numbers_of<float>(
      images, {slots.size(), facts.axes.size() + 1, facts.image_height, facts.image_width}, true, "images");
  const py::gil_scoped_release release;
  batch.render_slopes_at(slots, numbers, seeds.data(), samples, pixels);
}

void fields_at(Batch& batch, const Slots& slots, const py::buffer& poses, double lp_per_mm, const py::buffer& values) {
  const trials::SceneFacts& facts = batch.facts();
  const double* numbers = numbers_of<double>(poses, {slots.size(), facts.axes.size()}, false, "poses");
  double* rows = numbers_of<double>(values, {slots.size(), facts.fields.size(), std::size_t{4}}, true, "values");
  const py::gil_scoped_release release;
  batch.fields_at(slots, numbers, lp_per_mm, rows);
}

// Means and standard errors, one per slot.
py::tuple lists_of(const std::vector<trials::Truth>& truths) {
  std::vector<double> mse, error;
  for (const trials::Truth& truth : truths) mse.push_back(truth.mse), error.push_back(truth.standard_error);
  return py::make_tuple(mse, error);
}

py::tuple noise_free_mse(Batch& batch, const Slots& slots) {
  std::vector<trials::Truth> found;
  {
    const py::gil_scoped_release release;
    found = batch.truths(slots);
  }
  return lists_of(found);
}

py::tuple noise_free_mse_at(Batch& batch, const Slots& slots, const py::buffer& poses,
                            const std::vector<unsigned>& steps) {
  const double* numbers = numbers_of<double>(poses, {slots.size(), batch.facts().axes.size()}, false, "poses");
  if (steps.size() != slots.size()) throw Error(ErrorKind::bad_input, "noise_free_mse_at needs one step per slot");
  std::vector<trials::Truth> found;
  {
    const py::gil_scoped_release release;
    found = batch.truths_at(slots, numbers, steps);
  }
  return lists_of(found);
}

py::list optima(Batch& batch, const Slots& slots) {
  std::vector<std::optional<plugin_host::MountedAssembly::Optimum>> found;
  {
    const py::gil_scoped_release release;
    found = batch.optima(slots);
  }
  py::list list;
  for (const auto& optimum : found) {
    if (optimum)
      list.append(py::make_tuple(optimum->true_pose, optimum->mse));
    else
      list.append(py::none());
  }
  return list;
}

// Writes one row per slot.
void read_poses(const Batch& batch, const Slots& slots, const std::vector<double> Batch::State::*member,
                const py::buffer& into) {
  double* row = numbers_of<double>(into, {slots.size(), batch.facts().axes.size()}, true, "into");
  for (const unsigned slot : slots) {
    const std::vector<double>& pose = batch.state(slot).*member;
    row = std::copy(pose.begin(), pose.end(), row);
  }
}

// One number per slot.
void read_measured_error(const Batch& batch, const Slots& slots, const py::buffer& into) {
  double* value = numbers_of<double>(into, {slots.size()}, true, "into");
  for (const unsigned slot : slots) *value++ = batch.state(slot).measured_error;
}

// One row per slot: 1 for an axis that met a limit.
void read_limits(const Batch& batch, const Slots& slots, const py::buffer& into) {
  const std::size_t axes = batch.facts().axes.size();
  auto* met = numbers_of<std::uint8_t>(into, {slots.size(), axes}, true, "into");
  for (const unsigned slot : slots) {
    const auto either = batch.state(slot).limits_low | batch.state(slot).limits_high;
    for (std::size_t axis = 0; axis < axes; ++axis) *met++ = static_cast<std::uint8_t>(either >> axis & 1U);
  }
}

// Not on a GPU: the latest frames, read-only and valid as long as the batch: slots x height x width.
py::buffer_info frames(Batch& batch) {
  const py::ssize_t height = batch.facts().image_height, width = batch.facts().image_width, size = sizeof(float);
  return {const_cast<float*>(batch.frames()),
          size,
          py::format_descriptor<float>::format(),
          3,
          {py::ssize_t{batch.slots()}, height, width},
          {height * width * size, width * size, size},
          true};
}

void read_reference(const Batch& batch, const py::buffer& into) {
  float* pixels = numbers_of<float>(into, {batch.facts().image_height, batch.facts().image_width}, true, "reference");
  std::copy(batch.reference().begin(), batch.reference().end(), pixels);
}

py::dict instance(const Batch& batch, unsigned slot) {
  const trials::Instance& instance = batch.state(slot).instance;
  py::dict dict;
  dict["number"] = instance.number;
  dict["seed"] = instance.seed;
  dict["start"] = instance.perturbations.start;
  dict["distortion"] = instance.perturbations.distortion;
  dict["elements"] = instance.perturbations.elements_json;
  dict["cure_shift"] = instance.perturbations.cure_shift;
  py::dict stage;
  if (const std::optional<trials::StageErrors>& errors = instance.perturbations.stage) {
    stage["backlash"] = errors->backlash;
    stage["repeatability"] = errors->repeatability;
    stage["encoder_step"] = errors->encoder_step;
    stage["drift"] = errors->drift;
    stage["drift_seconds"] = errors->drift_seconds;
  }
  dict["stage"] = stage;
  return dict;
}

}  // namespace

void bind_batch(py::module_& module) {
  using py::arg;
  py::class_<Batch>(module, "Batch", py::buffer_protocol(),
                    "Many instances of one scene, moved and captured together. A buffer: the latest frames.")
      .def(py::init(&make_batch), arg("catalog"), arg("scene"), arg("scene_parameters"), arg("level"),
           arg("level_parameters"), arg("clipping"), arg("suite_seed"), arg("slots"), arg("threads"),
           arg("cache_folder"), arg("device"), py::keep_alive<1, 2>())
      .def_property_readonly("facts", [](const Batch& batch) { return batch.facts().text; })
      .def_property_readonly("axes", [](const Batch& batch) { return batch.facts().axes.size(); })
      .def_property_readonly("nominal_pose", [](const Batch& batch) { return batch.facts().nominal_pose; })
      .def_property_readonly("white", [](const Batch& batch) { return batch.facts().image_white; })
      .def_property_readonly("has_ground_truth", [](const Batch& batch) { return batch.facts().truth; })
      .def_property_readonly("slots", &Batch::slots)
      .def_property_readonly("threads", &Batch::threads)
      .def_property_readonly("height", [](const Batch& batch) { return batch.facts().image_height; })
      .def_property_readonly("width", [](const Batch& batch) { return batch.facts().image_width; })
      .def("read_reference", &read_reference, arg("into"))
      .def_buffer(&frames)
      .def(
          "set_frames",
          [](Batch& batch, std::uintptr_t address) { batch.set_frames(reinterpret_cast<float*>(address)); },
          arg("address"))
      .def("reset", &reset, arg("slots"), arg("domain"), arg("numbers"))
      .def("move_by", &move_by, arg("slots"), arg("moves"))
      .def("capture_at", &capture_at, arg("slots"), arg("poses"), arg("seeds"), arg("frames"))
      .def("capture_into", &capture_into, arg("slots"), arg("poses"), arg("seeds"), arg("address"))
      .def("render_at", &render_at, arg("slots"), arg("poses"), arg("frames"))
      .def("render_slopes_at", &render_slopes_at, arg("slots"), arg("poses"), arg("seeds"), arg("samples"),
           arg("images"))
      .def("fields_at", &fields_at, arg("slots"), arg("poses"), arg("lp_per_mm"), arg("values"))
      .def("noise_free_mse", &noise_free_mse, arg("slots"))
      .def("noise_free_mse_at", &noise_free_mse_at, arg("slots"), arg("poses"), arg("steps"))
      .def("optima", &optima, arg("slots"))
      .def("instance", &instance, arg("slot"))
      .def(
          "read_true_poses",
          [](const Batch& batch, const Slots& slots, const py::buffer& into) {
            read_poses(batch, slots, &Batch::State::true_pose, into);
          },
          arg("slots"), arg("into"))
      .def(
          "read_commanded_poses",
          [](const Batch& batch, const Slots& slots, const py::buffer& into) {
            read_poses(batch, slots, &Batch::State::commanded_pose, into);
          },
          arg("slots"), arg("into"))
      .def("read_measured_error", &read_measured_error, arg("slots"), arg("into"))
      .def("read_limits", &read_limits, arg("slots"), arg("into"));
}

}  // namespace relign::python
