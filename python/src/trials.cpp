// Trials of installed algorithms, equal to those of `relign-bench run`.
#include "base/error.h"
#include "base/text.h"
#include "bindings.h"
#include "records/record.h"
#include "runner/merits.h"
#include "runner/trial_runner.h"
#include "trials/stage.h"

namespace relign::python {
namespace {

// Keeps the scene and the lens between trials.
class Trials {
 public:
  Trials(plugin_host::Catalog& catalog, const std::string& scene, const std::string& scene_parameters,
         const std::string& level, const std::string& level_parameters, std::uint64_t suite_seed, unsigned threads,
         const std::string& cache_folder)
      : catalog_(catalog), runner_({threads, cache_folder, {}, nullptr}) {
    job_.scene = choose(catalog, plugin_host::Kind::scene, scene, scene_parameters);
    job_.level = choose(catalog, plugin_host::Kind::noise_level, level, level_parameters);
    job_.scene_name = job_.scene.id;
    job_.level_name = job_.level.id;
    job_.seeds = {suite_seed, suite_seed};
    const py::gil_scoped_release release;
    job_.facts = trials::facts_of(runner_.scene(job_), job_.scene.id);
    job_.machine_time = job_.facts.machine_time;
  }

  // The lines of the trial's record and times, and with keep_frames its captures: float32, frame by frame.
  py::tuple run(const std::string& algorithm, const std::string& parameters, std::uint64_t instance,
                const std::string& protocol, const std::string& merit, const std::string& limits, unsigned steps,
                bool keep_frames) {
    runner::TrialJob job = job_;
    job.algorithm = choose(catalog_, plugin_host::Kind::optimizer, algorithm, parameters);
    job.algorithm_name = job.algorithm.id;
    job.id = "python";
    job.instance = instance;
    job.budget = steps;
    const auto known = trials::protocol_from_name(protocol);
    if (!known) throw Error(ErrorKind::bad_input, "unknown protocol '" + protocol + "'; protocols: paper, blind");
    job.protocol = *known;
    job.merit = job.protocol == trials::Protocol::paper && !job.facts.owns_stage ? trials::Merit::combined
                                                                                 : trials::Merit::rmse;
    if (!merit.empty()) {
      const auto wanted = trials::merit_from_name(merit);
      if (!wanted)
        throw Error(ErrorKind::bad_input,
                    "unknown merit '" + merit + "'; merits: " + join(trials::merit_names(), ", "));
      job.merit = *wanted;
    }
    job.mtf_limits = runner::limits_of(records::specification_of(Json(), job.facts.spec, job.facts.score));
    job.criteria = trials::criteria_of(records::Specification(), job.facts);  // further scores alone
    job.limits = limits_of(limits);

    const std::size_t pixels = std::size_t{job.facts.image_width} * job.facts.image_height;
    std::vector<float> frames;
    runner::TrialRunner::OnStep on_step;
    if (keep_frames)
      on_step = [&](const trials::Step&, const float* frame) { frames.insert(frames.end(), frame, frame + pixels); };
    std::string lines;
    {
      const py::gil_scoped_release release;
      const runner::TrialOutcome outcome = runner_.run(job, nullptr, on_step);
      lines = records::to_lines(outcome.record) + "\n" + records::to_line(outcome.times);
    }
    py::object captured = py::none();
    if (keep_frames) captured = py::bytes(reinterpret_cast<const char*>(frames.data()), frames.size() * sizeof(float));
    return py::make_tuple(lines, captured);
  }

 private:
  plugin_host::Catalog& catalog_;
  runner::TrialRunner runner_;
  runner::TrialJob job_;
};

}  // namespace

void bind_trials(py::module_& module) {
  using py::arg;
  py::class_<Trials>(module, "Trials", "Trials of algorithms on the instances of one scene and noise level.")
      .def(py::init<plugin_host::Catalog&, const std::string&, const std::string&, const std::string&,
                    const std::string&, std::uint64_t, unsigned, const std::string&>(),
           arg("catalog"), arg("scene"), arg("scene_parameters"), arg("level"), arg("level_parameters"),
           arg("suite_seed"), arg("threads"), arg("cache_folder"), py::keep_alive<1, 2>())
      .def("run", &Trials::run, arg("algorithm"), arg("parameters"), arg("instance"), arg("protocol"), arg("merit"),
           arg("limits"), arg("steps"), arg("keep_frames"));
}

}  // namespace relign::python
