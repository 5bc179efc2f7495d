#include "runner/worker.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <tuple>

#include "base/fault.h"
#include "plugin_host/confinement.h"
#include "plugin_host/process_session.h"
#include "runner/pictures.h"
#include "runner/pretraining.h"
#include "runner/trial_journal.h"
#include "runner/trial_runner.h"
#include "runner/worker_plan.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define RELIGN_SANITIZED 1
#endif

namespace relign::runner {
namespace {

std::atomic<bool> memory_ran_out{false};

[[noreturn]] void note_that_memory_ran_out() {
  memory_ran_out = true;
  throw std::bad_alloc();
}

int descriptor_from_environment(const char* name) {
  const char* text = std::getenv(name);
  const int number = text ? std::atoi(text) : -1;
  if (number < 0 || ::fcntl(number, F_GETFD) < 0)
    throw Error(ErrorKind::bad_input, "'worker' is an internal command that 'run' starts");
  ::fcntl(number, F_SETFD, FD_CLOEXEC);
  return number;
}

// Lines from and to the coordinator. Read in a separate thread, because a plugin may not return.
class Channel {
 public:
  Channel()
      : out_(descriptor_from_environment("RELIGN_TO_HOST_FD")),
        in_(descriptor_from_environment("RELIGN_FROM_HOST_FD")) {
    std::thread([this] { read_all(); }).detach();
  }

  const std::atomic<bool>& stop() const { return stop_; }

  Json next() {
    std::unique_lock<std::mutex> hold(mutex_);
    arrived_.wait(hold, [this] { return !lines_.empty(); });
    const std::string line = std::move(lines_.front());
    lines_.pop_front();
    hold.unlock();
    return valid_json(line);
  }

  void send(const Json& message) {
    const std::string line = message.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
    const std::lock_guard<std::mutex> hold(send_mutex_);
    std::string_view left = line;
    while (!left.empty()) {
      const ssize_t sent = ::send(out_, left.data(), left.size(), MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) leave();
      left.remove_prefix(static_cast<std::size_t>(sent));
    }
  }

 private:
  void read_all() {
    std::string text;
    std::size_t searched = 0;
    char buffer[1 << 16];
    while (true) {
      const ssize_t got = ::recv(in_, buffer, sizeof buffer, 0);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) leave();
      text.append(buffer, static_cast<std::size_t>(got));
      for (std::size_t end; (end = text.find('\n', searched)) != std::string::npos; searched = 0) {
        take(text.substr(0, end));
        text.erase(0, end + 1);
      }
      searched = text.size();
    }
  }

  void take(std::string line) {
    if (line == R"({"stop":true})") {
      stop_ = true;
      return;
    }
    const std::lock_guard<std::mutex> hold(mutex_);
    lines_.push_back(std::move(line));
    arrived_.notify_one();
  }

  // The coordinator is gone. Exits without running the plugins' destructors, because they may hang.
  [[noreturn]] static void leave() {
    plugin_host::end_children();
    if (::getsid(0) == ::getpid()) plugin_host::kill_session(::getpid(), ::getpid());
    plugin_host::kill_descendants();
    ::_exit(0);
  }

  int out_, in_;
  std::atomic<bool> stop_{false};
  std::mutex mutex_, send_mutex_;
  std::condition_variable arrived_;
  std::deque<std::string> lines_;
};

void limit_resources([[maybe_unused]] std::size_t memory_bytes) {
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
#ifndef RELIGN_SANITIZED  // the shadow memory of sanitizers is larger than any limit
  if (memory_bytes > 0) {
    const rlimit data{memory_bytes, memory_bytes};
    ::setrlimit(RLIMIT_DATA, &data);
  }
#endif
  std::set_new_handler(note_that_memory_ran_out);
}

class Worker {
 public:
  Worker() : journal_(descriptor_from_environment("RELIGN_JOURNAL_FD")) {
    // Line-buffered, so that all output of a plugin is written when its trial ends.
    std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  }

  int serve() {
    while (true) {
      const Json message = channel_.next();
      try {
        if (message.contains("trial"))
          run(planned_trial_from_json(message.at("trial")));
        else if (message.contains("prepare"))
          prepare(message.at("prepare"));
        else if (message.contains("prepared"))
          keep_prepared(message.at("prepared"));
        else if (message.contains("setup"))
          set_up(message.at("setup"));
      } catch (const Error& error) {
        channel_.send({{"error", {{"kind", static_cast<int>(error.kind())}, {"text", error.what()}}}});
      } catch (const std::bad_alloc&) {
        channel_.send({{"done", {{"out_of_memory", true}}}});
      } catch (const std::exception& error) {
        channel_.send({{"error", {{"kind", static_cast<int>(ErrorKind::internal)}, {"text", fault_text(error)}}}});
      }
    }
  }

 private:
  using Group = std::tuple<std::size_t, std::size_t, std::size_t>;

  void set_up(const Json& setup) {
    plan_ = worker_plan_from_json(setup.at("plan"));
    results_ = setup.at("results").get<std::string>();
    TrialRunner::Options options;
    options.threads = setup.at("threads").get<unsigned>();
    options.cache_folder = setup.at("cache_folder").get<std::string>();
    options.stop = &channel_.stop();
    if (const Json& sandbox = setup.at("sandbox"); !sandbox.is_null())
      options.sandbox = std::make_shared<const plugin_host::Sandbox>(plugin_host::sandbox_from_json(sandbox));
    options.on_message = [this](const std::string& text) { channel_.send({{"message", text}}); };
    options.on_log = [this](std::string_view text) { journal_.add_log(text); };
    options.on_runaway = [this] {
      channel_.send({{"runaway", true}});
      while (true) ::pause();
    };
    options.on_begin = [this](const records::TrialRecord& record) {
      channel_.send({{"begun", records::closing_line(record, 0)}});
    };
    Pretrainer::Options pretrainer_options;
    pretrainer_options.threads = options.threads;
    pretrainer_options.cache_folder = options.cache_folder;
    pretrainer_options.on_message = options.on_message;
    pretrainer_options.on_source = [this] { channel_.send({{"source", true}}); };
    pretrainer_options.stop = options.stop;
    pretrainer_options.sandbox = options.sandbox;
    pretrainer_.emplace(std::move(pretrainer_options));
    runner_.emplace(std::move(options));
    limit_resources(setup.at("memory_bytes").get<std::size_t>());
    channel_.send({{"ready", true}});
  }

  static Group group_of(const Json& json) {
    return {json.at("scene").get<std::size_t>(), json.at("level").get<std::size_t>(),
            json.at("algorithm").get<std::size_t>()};
  }

  void keep_prepared(const Json& json) { prepared_[group_of(json)] = data_of(entries_from_json(json.at("entries"))); }

  void prepare(const Json& request) {
    const suites::PlannedTrial trial = planned_trial_from_json(request.at("trial"));
    plan_.check_libraries(trial);
    const Pretrainer::Entries& entries =
        pretrainer_->prepare(make_job(plan_.prepared, trial), request.at("scene_data").get<std::string>());
    journal_.write_text(to_json(entries).dump(-1, ' ', false, Json::error_handler_t::replace));
    channel_.send({{"entries", {{"size", journal_.size()}, {"digest", journal_.digest()}}}});
  }

  void run(const suites::PlannedTrial& trial) {
    const double received_at = clock_seconds();
    plan_.check_libraries(trial);
    memory_ran_out = false;
    journal_.begin();
    TrialJob job = make_job(plan_.prepared, trial);
    if (const auto found = prepared_.find({trial.scene, trial.level, trial.algorithm}); found != prepared_.end())
      job.prepared = found->second;
    KeptCaptures captures(job.facts);
    const auto on_step = [&](const trials::Step& step, const float* pixels) {
      if (job.facts.owns_stage) captures.keep(step, pixels);
      journal_.add_step(trial.id, step, step.algorithm_seconds, step.simulation_seconds, step.truth_seconds);
    };
    TrialOutcome outcome = runner_->run(job, &channel_.stop(), on_step);
    // Writes out what the plugin has buffered in these streams.
    std::cout.flush();
    std::fflush(nullptr);
    if (job.facts.owns_stage && !outcome.stopped) captures.write(results_, trial.id);
    if (outcome.record.end == "failed" && memory_ran_out) outcome.record.end = "out_of_memory";
    const std::size_t steps = outcome.record.steps.size();
    channel_.send({{"done",
                    {{"closing", records::closing_line(outcome.record, steps)},
                     {"stopped", outcome.stopped},
                     {"received_at", received_at},
                     {"sent_at", clock_seconds()},
                     {"harness_seconds", outcome.times.harness_seconds},
                     {"size", journal_.size()},
                     {"digest", journal_.digest()}}}});
  }

  Channel channel_;
  JournalWriter journal_;
  WorkerPlan plan_;
  std::filesystem::path results_;
  std::map<Group, std::shared_ptr<const trials::PreparedByIdentity>> prepared_;
  std::optional<TrialRunner> runner_;
  std::optional<Pretrainer> pretrainer_;
};

}  // namespace

int run_worker() {
  plugin_host::adopt_orphans();
  return Worker().serve();
}

}  // namespace relign::runner
