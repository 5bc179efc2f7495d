#include "runner/trial_runner.h"

#include <chrono>
#include <optional>
#include <utility>

#include "base/seeds.h"
#include "records/results_folder.h"
#include "records/specification.h"
#include "runner/merits.h"
#include "runner/spec_check.h"
#include "trials/own_optimum.h"

namespace relign::runner {
namespace {

void add_steps(const std::vector<trials::Step>& steps, TrialOutcome& outcome) {
  for (const trials::Step& step : steps) {
    outcome.record.steps.push_back(step);
    outcome.times.algorithm_seconds.push_back(step.algorithm_seconds);
    outcome.times.simulation_seconds.push_back(step.simulation_seconds);
    outcome.times.truth_seconds.push_back(step.truth_seconds);
  }
}

// Equal keys: the same library with the same parameters and data.
std::string key_of(const plugin_host::Choice& choice) {
  return choice.plugin->library.string() + "\n" + choice.identity;
}

SeedDomain domain_of(const TrialJob& job) { return job.pretraining ? SeedDomain::pretraining : SeedDomain::benchmark; }

trials::Terms terms_of(const TrialJob& job) {
  return {.protocol = job.protocol,
          .merit = job.merit,
          .mtf_limits = job.mtf_limits,
          .limits = job.limits,
          .budget = job.budget,
          .algorithm_seed = algorithm_seed(job.seeds.algorithms, job.algorithm_name, job.instance),
          .machine_time = job.machine_time};
}

trials::Purpose purpose_of(const TrialJob& job) {
  if (job.pretraining) return trials::Pretraining{*job.pretraining};
  return trials::Scoring{job.mtf_lp_per_mm};
}

}  // namespace

records::TrialRecord begin_record(const TrialJob& job) {
  records::TrialRecord record;
  record.trial = job.id;
  record.scene = job.scene_name;
  record.noise_level = job.level_name;
  record.protocol = trials::protocol_name(job.protocol);
  record.algorithm = job.algorithm_name;
  record.algorithm_id = job.algorithm.id;
  record.method = job.method;
  record.training = job.training;
  record.instance = job.instance;
  if (!job.sealed) record.instance_seed = instance_seed(job.seeds.instances, domain_of(job), job.instance);
  record.budget = job.budget;
  return record;
}

TrialJob make_job(const PreparedPlan& prepared, const suites::PlannedTrial& trial) {
  const suites::Suite& suite = prepared.plan.suite;
  const suites::AlgorithmEntry& algorithm = suite.algorithms.at(trial.algorithm);
  const auto protocol = trials::protocol_from_name(algorithm.protocol);
  if (!protocol) throw Error(ErrorKind::internal, "unknown protocol '" + algorithm.protocol + "' in a plan");
  TrialJob job;
  job.id = trial.id;
  job.scene_name = suite.scenes.at(trial.scene).name;
  job.level_name = suite.levels.at(trial.level).name;
  job.algorithm_name = algorithm.name;
  job.method = algorithm.method;
  job.training = algorithm.training;
  job.scene = suite.scenes[trial.scene].choice;
  job.level = suite.levels[trial.level].choice;
  job.algorithm = algorithm.choice;
  job.facts = prepared.scenes.at(trial.scene);
  job.protocol = *protocol;
  const auto merit = trials::merit_from_name(suites::effective_merit(algorithm));
  if (!merit) throw Error(ErrorKind::internal, "unknown merit '" + algorithm.merit + "' in a plan");
  const bool unknown_pose = job.facts.owns_stage && *merit == trials::Merit::combined;
  job.merit = unknown_pose ? trials::Merit::rmse : *merit;
  job.limits = suite.limits == "hard" ? trials::Limits::hard : trials::Limits::soft;
  job.machine_time = trials::changed_by(suite.machine_time, job.facts.machine_time);
  job.budget = algorithm.steps;
  const records::Specification spec = records::specification_of(suite.spec, job.facts.spec, job.facts.score);
  if (spec.measures_mtf()) job.mtf_lp_per_mm = spec.lp_per_mm;
  job.mtf_limits = limits_of(spec);
  job.criteria = trials::criteria_of(spec, job.facts);
  job.seeds = suite.draw_seeds();
  job.sealed = !suite.commitment.empty();
  job.instance = trial.instance;
  return job;
}

// State kept from trial to trial. The order of members matters: the lens is destroyed before its scene.
struct TrialRunner::Bench {
  std::string scene_key, level_key;
  std::unique_ptr<plugin_host::Scene> scene;
  std::unique_ptr<trials::ModelScene> model;
  std::unique_ptr<plugin_host::NoiseLevel> level;
  std::string mounted_key;  // suite seed and instance
  trials::Instance instance;
  std::unique_ptr<plugin_host::MountedAssembly> assembly;
  std::optional<records::OwnOptimum> own_optimum;  // of the assembly, once requested
  double own_optimum_lp_per_mm = 0;                // of its MTF

  std::string design_key;  // of the scene and the frequency
  trials::FieldValues design;
  std::optional<std::pair<std::string, trials::Judge::Optimum>> criterion_optimum;  // of the assembly; by limits

  const records::OwnOptimum& optimum(const trials::SceneFacts& facts, double lp_per_mm) {
    if (!own_optimum) {
      own_optimum.emplace();
      const std::uint64_t seed = frame_seed(instance.seed, 0, FrameStream::own_optimum);
      if (auto found = trials::own_optimum(*assembly, facts, seed)) {
        own_optimum->mse = found->mse;
        own_optimum->pose = std::move(found->true_pose);
      }
    }
    if (own_optimum_lp_per_mm != lp_per_mm && !own_optimum->pose.empty()) {
      own_optimum->mtf = lp_per_mm > 0 ? trials::mtf_at(*assembly, own_optimum->pose, lp_per_mm) : records::MtfRecord();
      own_optimum_lp_per_mm = lp_per_mm;
    }
    return *own_optimum;
  }

  void unmount() {
    assembly.reset();
    own_optimum.reset();
    own_optimum_lp_per_mm = 0;
    criterion_optimum.reset();
    mounted_key.clear();
  }
};

TrialRunner::TrialRunner(Options options)
    : options_(std::move(options)),
      log_(std::make_shared<TrialLog>(options_.on_log)),
      bench_(std::make_unique<Bench>()) {}
TrialRunner::~TrialRunner() = default;

plugin_host::HostServices TrialRunner::services(const std::string& name, unsigned threads, bool algorithm) const {
  plugin_host::HostServices services;
  services.threads = threads;
  services.cache_folder = options_.cache_folder;
  services.stop = options_.stop;
  services.sandbox = options_.sandbox;
  services.log = [notify = options_.on_message, log = log_, name, who = algorithm ? "" : name](
                     int level, const std::string& message) {
    log->add(level, who, message);
    if (notify && level >= RELIGN_LOG_WARNING) notify(name + ": " + message);
  };
  return services;
}

plugin_host::Scene& TrialRunner::scene(const TrialJob& job) {
  const std::string key = key_of(job.scene);
  if (!bench_->scene || bench_->scene_key != key) {
    bench_->unmount();
    bench_->model.reset();
    bench_->scene.reset();  // two at once would need twice the memory
    const plugin_host::HostServices own = services(job.scene_name, options_.threads);
    bench_->scene = std::make_unique<plugin_host::Scene>(job.scene, own);
    bench_->model = std::make_unique<trials::ModelScene>(*bench_->scene, job.scene, own);
    bench_->scene_key = key;
  }
  return *bench_->scene;
}

TrialRunner::Placed TrialRunner::place(const TrialJob& job) {
  plugin_host::Scene& on = scene(job);
  const std::string level_key = key_of(job.level);
  if (!bench_->level || bench_->level_key != level_key) {
    bench_->unmount();
    bench_->level.reset();
    bench_->level = std::make_unique<plugin_host::NoiseLevel>(job.level, services(job.level_name, 1));
    bench_->level_key = level_key;
  }
  const SeedDomain domain = domain_of(job);
  const std::string mounted_key = std::to_string(static_cast<unsigned>(domain)) + " " +
                                  std::to_string(job.seeds.instances) + " " + std::to_string(job.instance);
  if (bench_->mounted_key != mounted_key) {
    bench_->unmount();
    bench_->instance = trials::draw_instance(*bench_->level, job.facts, job.seeds.instances, domain, job.instance);
    if (!job.facts.owns_stage) {
      bench_->assembly =
          std::make_unique<plugin_host::MountedAssembly>(on.mount(bench_->instance.perturbations.elements_json));
    }
    bench_->mounted_key = mounted_key;
  }
  const bool known = bench_->assembly && job.facts.truth && !job.pretraining;
  return {bench_->instance, bench_->assembly.get(), on.reference(),
          [bench = bench_.get(), known, facts = job.facts, lp_per_mm = job.mtf_lp_per_mm] {
            return known ? bench->optimum(facts, lp_per_mm) : records::OwnOptimum();
          }};
}

trials::StageSetup TrialRunner::stage(const TrialJob& job, const Placed& placed) const {
  if (job.facts.owns_stage) return trials::Station{*bench_->scene};
  return trials::SimulatedLens{*placed.assembly, *bench_->model, *bench_->level};
}

// Of every step that the record has, where its recommendation leaves the lens.
void TrialRunner::judge(const TrialJob& job, const std::vector<double>& own_optimum, records::TrialRecord& record) {
  if (bench_->design_key != bench_->scene_key) {
    bench_->design.clear();
    if (job.criteria.needs(CriterionNeeds::fields)) {
      plugin_host::MountedAssembly perfect = bench_->scene->mount("{}");
      bench_->design = trials::measure_fields(perfect, job.facts, job.criteria.lp_per_mm, job.facts.nominal_pose);
    }
    bench_->design_key = bench_->scene_key;
  }
  trials::Judge judge(*bench_->assembly, job.facts, job.criteria, bench_->design,
                      frame_seed(bench_->instance.seed, 0, FrameStream::own_optimum));
  std::vector<double> optimum = own_optimum;
  if (!job.criteria.field_mtf.empty()) {
    const std::string key = key_of(job.criteria);
    if (!bench_->criterion_optimum || bench_->criterion_optimum->first != key)
      bench_->criterion_optimum.emplace(key,
                                        *judge.optimum(own_optimum.empty() ? job.facts.nominal_pose : own_optimum));
    const trials::Judge::Optimum& found = bench_->criterion_optimum->second;
    record.criterion_optimum_pose = optimum = found.true_pose;
    record.criterion_optimum_deficit = found.deficit;
  }
  for (std::size_t i = 0; i < job.facts.score.further.size() && !own_optimum.empty(); ++i)
    record.own_optimum.further_scores.push_back(judge.at(own_optimum, optimum)[further_score(i)]);
  for (const records::StepRecord& step : record.steps)
    for (const ByCriterion<double> values = judge.at(step.recommended_true_pose, optimum);
         const Criterion one : kCriteria)
      if (job.criteria.judged[one]) record.criteria[one].push_back(values[one]);
}

TrialOutcome TrialRunner::run(const TrialJob& job, const std::atomic<bool>* stop, const OnStep& on_step) {
  TrialOutcome outcome;
  records::TrialRecord& record = outcome.record = begin_record(job);
  outcome.times.trial = job.id;

  std::vector<trials::Step> made;  // survive a failure of the scene
  try {
    const Placed placed = place(job);
    record.own_optimum = placed.own_optimum();
    if (options_.on_begin) options_.on_begin(record);
    trials::TrialSetup setup{.stage = stage(job, placed),
                             .reference = placed.reference,
                             .scene = job.facts,
                             .instance = placed.instance,
                             .algorithm = job.algorithm,
                             .terms = terms_of(job),
                             .purpose = purpose_of(job),
                             .services = services(job.algorithm_name, 1, true)};
    if (job.prepared) setup.prepared = *job.prepared;
    setup.services.stop = stop;
    setup.services.saves = job.pretraining != nullptr;
    setup.callbacks.on_runaway = options_.on_runaway;
    setup.callbacks.on_step = [&made, &on_step](const trials::Step& step, const float* pixels) {
      made.push_back(step);
      if (on_step) on_step(step, pixels);
    };
    const auto begin = std::chrono::steady_clock::now();
    log_->begin();  // not earlier: which trial creates a scene depends on the workers
    const trials::TrialResult result = trials::run_trial(setup);
    outcome.stopped = result.end == trials::End::stopped;
    record.end = result.outcome.empty() || outcome.stopped ? trials::end_name(result.end) : result.outcome;
    record.message = result.message;
    record.scores = result.scores;
    for (const std::string& change : result.environment_changes)
      record.warnings.push_back(job.algorithm.id + ": " + change);
    add_steps(result.steps, outcome);
    if (job.criteria.any() && !job.pretraining && !outcome.stopped) judge(job, record.own_optimum.pose, record);
    outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    outcome.times.harness_seconds = outcome.seconds - result.seconds_after_last_step - result.judging_seconds -
                                    records::step_seconds(outcome.times);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::plugin_failed) throw;
    bench_ = std::make_unique<Bench>();  // the state of the scene is unknown
    const auto* ended = dynamic_cast<const plugin_host::PluginEnded*>(&error);
    record.end = ended ? ended->outcome() : trials::end_name(trials::End::failed);
    record.message = error.what();
    outcome.stopped = stop && stop->load();  // the failure may come from a process that we no longer wait for
    if (record.steps.empty()) add_steps(made, outcome);  // else only what judges them failed
  }
  outcome.log = log_->take();
  return outcome;
}

}  // namespace relign::runner
