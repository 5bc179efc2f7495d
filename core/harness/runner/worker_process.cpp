#include "runner/worker_process.h"

#include <unistd.h>

#include <algorithm>
#include <utility>

#include "base/machine.h"
#include "base/text.h"
#include "plugin_host/confinement.h"
#include "plugin_host/process_session.h"
#include "runner/trial_journal.h"
#include "runner/trial_log.h"
#include "runner/trial_runner.h"
#include "runner/worker.h"
#include "runner/worker_plan.h"

namespace relign::runner {
namespace {

using plugin_host::ChildProcess;
using plugin_host::in_seconds;
using plugin_host::kSecondsToExit;
using Clock = plugin_host::ProcessClock;

constexpr double kSecondsToStart = 120;
constexpr double kSecondsAfterStop = 5;
constexpr double kSecondsToLeave = kSecondsToExit + 1;  // of a worker whose connection is closed: it ends its children
constexpr double kStopPollSeconds = 0.1;
constexpr double kMemoryPollSeconds = 1;
constexpr int kMaxLosses = 3;

double elapsed(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

std::size_t session_bytes(pid_t session) {
  std::size_t bytes = 0;
  for (const pid_t process : plugin_host::processes_of_session(session)) bytes += plugin_host::resident_bytes(process);
  return bytes;
}

// Checks every member, because a plugin can write into the worker's connection.
std::string error_text(const Json& error) {
  const auto text = error.is_object() ? error.find("text") : error.end();
  return error.is_object() && text != error.end() && text->is_string() ? text->get<std::string>()
                                                                       : "a worker reported an error without a message";
}

ErrorKind error_kind(const Json& error) {
  const auto kind = error.find("kind");
  const bool known = kind != error.end() && kind->is_number_unsigned() &&
                     kind->get<std::uint64_t>() <= static_cast<std::uint64_t>(ErrorKind::internal);
  return known ? static_cast<ErrorKind>(kind->get<int>()) : ErrorKind::internal;
}

void fill(WorkedTrial& worked, Journal journal) {
  worked.step_lines = std::move(journal.step_lines);
  worked.steps = journal.steps;
  worked.times = std::move(journal.times);
  worked.log = std::move(journal.log);
}

// `ended_before`: processes_ended_for_memory() before the kill.
std::string who_killed(long long ended_before) {
  const long long ended = processes_ended_for_memory();
  if (ended < 0 || ended_before < 0) return "the machine may be short of memory";
  return ended > ended_before ? "the machine is short of memory"
                              : "not for lack of memory either, but by its plugin or another program";
}

}  // namespace

// One attempt at one trial.
struct ProcessWorker::Attempt {
  const suites::PlannedTrial* trial = nullptr;
  WorkedTrial worked;
  Fate fate = Fate::finished;
  bool begun = false;
  bool pretraining = false;  // pretraining for `trial` instead of running it
  std::optional<Pretrainer::Entries> entries;
  StepCounter steps;
  bool malformed_line = false;             // received a line that is not a message
  Clock::time_point clock = Clock::now();  // start of the limited time: first of mounting the lens, then of the trial
  Clock::time_point memory_checked = Clock::now();
  std::optional<Clock::time_point> stop_sent;
  double sent_at = 0;  // by clock_seconds

  std::string after_steps() const {
    if (pretraining) return "";
    return worked.steps == 0 ? " before the end of step 0" : " after step " + std::to_string(worked.steps - 1);
  }
};

ProcessWorker::ProcessWorker(const PreparedPlan& plan, const LibraryHashes& hashes, std::vector<std::string> program,
                             Limits limits, WorkerOptions options)
    : plan_(plan), hashes_(hashes), program_(std::move(program)), limits_(limits), options_(std::move(options)) {}

ProcessWorker::~ProcessWorker() { stop_worker(kSecondsToExit); }

void ProcessWorker::stop_worker(double timeout_seconds) {
  if (child_) child_->end(timeout_seconds);
  if (child_) plugin_host::kill_orphans();  // what left the session of the worker
  child_.reset();
  sent_.clear();
  trials_ = 0;
}

void ProcessWorker::start() {
  for (int losses = 0; !started(); ++losses)
    if (losses + 1 == kMaxLosses)
      throw Error(ErrorKind::internal, "a worker did not start: it was killed from outside (SIGKILL) " +
                                           std::to_string(kMaxLosses) + " times; the machine may be short of memory");
}

// False when it was killed from outside.
bool ProcessWorker::started() {
  ChildProcess::Options options;
  options.command = program_;
  options.environment = {"RELIGN_JOURNAL_FD=" + std::to_string(ChildProcess::childs_pixel_file())};
  options.leads_session = true;
  options.on_output = [this](const std::string& line) {
    if (printed_.size() + line.size() < TrialLog::kMaxBytes && cut_bytes_ == 0)
      printed_ += "printed: " + line + "\n";
    else
      cut_bytes_ += line.size() + 1;
  };
  child_.emplace(std::move(options));
  send({{"setup",
         {{"plan", to_json(plan_, hashes_)},
          {"threads", options_.threads},
          {"results", options_.results.string()},
          {"cache_folder", options_.cache_folder.string()},
          {"sandbox", options_.sandbox ? plugin_host::to_json(*options_.sandbox) : Json()},
          {"memory_bytes", limits_.memory_bytes}}}});
  std::string line;
  const auto got = child_->receive(line, in_seconds(kSecondsToStart));
  const Json answer = got == ChildProcess::Got::line ? parsed_json(line) : Json();
  if (answer.is_object() && answer.contains("ready")) return true;
  child_->end(kSecondsToExit);
  if (child_->was_lost()) return false;
  std::string text = "a worker did not start: ";
  if (answer.is_object() && answer.contains("error"))
    text += error_text(answer["error"]);
  else
    text += "its process " + child_->how_it_ended();
  for (const std::string& output : child_->last_output()) text += "\n  " + output;
  throw Error(ErrorKind::internal, text);
}

void ProcessWorker::send(const Json& message) {
  // No check here: a worker that does not read is detected by its missing answer.
  child_->send(message.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n", in_seconds(kSecondsToStart));
}

void ProcessWorker::send_prepared(const suites::PlannedTrial& trial, const Pretrainer::Entries* prepared) {
  if (!prepared || !sent_.insert({trial.scene, trial.level, trial.algorithm}).second) return;
  send({{"prepared",
         {{"scene", trial.scene},
          {"level", trial.level},
          {"algorithm", trial.algorithm},
          {"entries", runner::to_json(*prepared)}}}});
}

WorkedTrial ProcessWorker::run(const suites::PlannedTrial& trial, const Pretrainer::Entries* prepared) {
  int losses = 0;
  const long long ended_before = processes_ended_for_memory();
  while (true) {
    if (!child_) start();
    const bool was_new = trials_ == 0;
    Attempt attempt = this->attempt(trial, prepared);
    if (attempt.fate == Fate::lost && ++losses < kMaxLosses) {
      if (options_.on_message)
        options_.on_message("a worker was killed from outside; trial " + trial.id + " runs again");
      continue;
    }
    if (attempt.fate == Fate::blamed) stop_worker(0);
    if (attempt.fate == Fate::blamed && !was_new) continue;
    if (attempt.fate == Fate::lost)
      attempt.worked.record.message = "its worker was killed by SIGKILL " + std::to_string(kMaxLosses) +
                                      " times, not by this run; " + who_killed(ended_before);
    if (child_ && holds_too_much()) stop_worker(kSecondsToExit);
    return std::move(attempt.worked);
  }
}

Pretrainer::Entries ProcessWorker::prepare(const suites::PlannedTrial& trial) {
  for (int losses = 0;; ++losses) {
    if (!child_) start();
    Attempt attempt;
    attempt.trial = &trial;
    attempt.pretraining = true;
    clear_journal(child_->pixel_file());
    send({{"prepare", {{"trial", to_json(trial)}, {"scene_data", plan_.scene_identity[trial.scene]}}}});
    ++trials_;
    while (const std::optional<Json> message = receive(attempt))
      if (take(*message, attempt)) break;
    if (attempt.worked.stopped) throw Error(ErrorKind::stopped, "stopped during pretraining");
    if (attempt.entries) return std::move(*attempt.entries);
    if (attempt.fate == Fate::lost && losses + 1 < kMaxLosses) continue;
    const records::TrialRecord& record = attempt.worked.record;
    return without_data(plan_.plan.suite.algorithms[trial.algorithm].choice, record.end + ", " + record.message);
  }
}

bool ProcessWorker::holds_too_much() const {
  return limits_.spare_bytes > 0 && plugin_host::resident_bytes(child_->process()) > limits_.spare_bytes;
}

ProcessWorker::Attempt ProcessWorker::attempt(const suites::PlannedTrial& trial, const Pretrainer::Entries* prepared) {
  Attempt attempt;
  attempt.trial = &trial;
  attempt.worked.record = begin_record(make_job(plan_, trial));
  printed_.clear();
  cut_bytes_ = 0;
  clear_journal(child_->pixel_file());
  send_prepared(trial, prepared);
  attempt.sent_at = clock_seconds();
  send({{"trial", to_json(trial)}});
  ++trials_;
  while (true) {
    const std::optional<Json> message = receive(attempt);
    if (!message || take(*message, attempt)) break;
  }
  if (cut_bytes_ > 0) printed_ += "(cut here: " + std::to_string(cut_bytes_) + " bytes more)\n";
  attempt.worked.log += printed_;
  return attempt;
}

// Receives the next message; nothing when the trial has ended without one.
std::optional<Json> ProcessWorker::receive(Attempt& attempt) {
  while (true) {
    std::string line;
    const auto got = child_->receive(line, in_seconds(kStopPollSeconds));
    if (got == ChildProcess::Got::line) {
      Json message = parsed_json(line);
      if (message.is_object()) return message;
      // Wait for the end: the steps of a trial must not depend on when this line was read.
      attempt.malformed_line = true;
      continue;
    }
    if (got == ChildProcess::Got::end) {
      take_death(attempt);
      return std::nullopt;
    }
    if (got == ChildProcess::Got::too_long || got == ChildProcess::Got::end_within_line) {
      end_by(attempt, "protocol_error", "its worker sent an incomplete message");
      return std::nullopt;
    }
    if (options_.on_captures && attempt.begun) options_.on_captures(attempt.steps.count(child_->pixel_file()));
    if (options_.stop && options_.stop->load() && !attempt.stop_sent) {
      attempt.stop_sent = Clock::now();
      child_->send("{\"stop\":true}\n", in_seconds(1));
    }
    if (attempt.stop_sent && elapsed(*attempt.stop_sent) > kSecondsAfterStop) {
      attempt.worked.stopped = true;
      attempt.fate = Fate::stopped;
      stop_worker(kSecondsToLeave);
      return std::nullopt;
    }
    if (elapsed(attempt.clock) > limits_.trial_seconds) {
      end_by(attempt, "timeout",
             std::string(attempt.pretraining ? "one source"
                         : attempt.begun     ? "the trial"
                                             : "mounting the lens") +
                 " took longer than " + shortest(limits_.trial_seconds) + " s ('trial_seconds' of the suite)");
      attempt.fate = Fate::finished;  // a new worker would not be faster
      return std::nullopt;
    }
    if (limits_.memory_bytes > 0 && elapsed(attempt.memory_checked) > kMemoryPollSeconds) {
      attempt.memory_checked = Clock::now();
      if (session_bytes(child_->process()) > limits_.memory_bytes) {
        end_by(attempt, "out_of_memory", "");
        return std::nullopt;
      }
    }
  }
}

bool ProcessWorker::take(const Json& message, Attempt& attempt) {
  try {
    if (message.contains("message")) {
      if (options_.on_message) options_.on_message(message["message"].get<std::string>());
      return false;
    }
    if (message.contains("begun")) {
      attempt.worked.record.own_optimum =
          records::read_trial_line(message["begun"].get<std::string>(), "").trial.own_optimum;
      attempt.begun = true;
      attempt.clock = Clock::now();
      if (options_.on_captures) options_.on_captures(0);
      return false;
    }
    if (attempt.pretraining && message.contains("source")) {
      attempt.clock = Clock::now();
      return false;
    }
    if (attempt.pretraining && message.contains("entries")) {
      const JournalText prepared = read_journal_text(child_->pixel_file());
      if (message["entries"].at("size") != prepared.text.size() || message["entries"].at("digest") != prepared.digest)
        throw Error(ErrorKind::bad_input, "");
      attempt.entries = entries_from_json(valid_json(prepared.text));
      return true;
    }
    if (message.contains("runaway")) {
      end_by(attempt, "overspent", "kept asking for steps after the last one and never returned");
      return true;
    }
    if (message.contains("done")) {
      take_done(message["done"], attempt);
      return true;
    }
  } catch (const Json::exception&) {
    end_by(attempt, "protocol_error", "its worker sent a malformed message with missing members");
    return true;
  } catch (const Error&) {
    end_by(attempt, "protocol_error", "its worker sent a malformed message with invalid members");
    return true;
  }
  if (message.contains("error") && message["error"].is_object())
    throw Error(error_kind(message["error"]), error_text(message["error"]));
  end_by(attempt, "protocol_error", "its worker sent an unknown message");
  return true;
}

void ProcessWorker::take_done(const Json& done, Attempt& attempt) {
  WorkedTrial& worked = attempt.worked;
  child_->take_up_output();
  if (done.contains("out_of_memory")) {
    end_by(attempt, "out_of_memory", "");
    return;
  }
  if (done.at("stopped").get<bool>()) {
    worked.stopped = true;
    attempt.fate = Fate::stopped;
    return;
  }
  Journal journal = read_journal(child_->pixel_file(), attempt.trial->id, false);
  records::ReadLine closing;
  try {
    closing = records::read_trial_line(done.at("closing").get<std::string>(), "the closing line");
  } catch (const Error&) {
  }
  if (journal.size != done.at("size") || journal.digest != done.at("digest") || !closing.closing ||
      closing.steps != journal.steps || closing.trial.trial != attempt.trial->id) {
    end_by(attempt, "protocol_error", "the journal of its worker was changed by another writer");
    fill(worked, Journal{});  // none of it can be trusted
    worked.times.trial = attempt.trial->id;
    return;
  }
  worked.record = std::move(closing.trial);
  if (attempt.malformed_line) {
    worked.record.end = "protocol_error";
    worked.record.message = "its worker sent a line that is not a message";
    attempt.fate = Fate::blamed;
  }
  fill(worked, std::move(journal));
  // Adds the time of the messages in both directions. Both sides use the same system clock.
  if (const Json& harness = done.at("harness_seconds"); !harness.is_null())
    worked.times.harness_seconds = harness.get<double>() + done.at("received_at").get<double>() - attempt.sent_at +
                                   clock_seconds() - done.at("sent_at").get<double>();
  if (worked.record.end == "out_of_memory") {
    worked.record.message = memory_message(attempt);
    attempt.fate = Fate::blamed;
  }
}

// Keeps the finished steps of a worker that cannot continue, and ends it.
void ProcessWorker::end_by(Attempt& attempt, const std::string& end, const std::string& message) {
  attempt.fate = Fate::blamed;
  WorkedTrial& worked = attempt.worked;
  fill(worked, read_journal(child_->pixel_file(), attempt.trial->id, true));
  worked.record.end = end;
  worked.record.message = message + (message.empty() ? "" : attempt.after_steps());
  if (end == "out_of_memory") worked.record.message = memory_message(attempt);
  stop_worker(end == "timeout" ? kSecondsToLeave : 0);
}

std::string ProcessWorker::memory_message(const Attempt& attempt) const {
  return "it needs more memory than the limit of " + std::to_string(limits_.memory_bytes / 1'000'000) +
         " MB ('trial_memory_mb' of the suite)" + attempt.after_steps();
}

void ProcessWorker::take_death(Attempt& attempt) {
  // Duplicated, because end() closes the child's descriptors.
  const plugin_host::Descriptor journal(::dup(child_->pixel_file()));
  child_->end(kSecondsToExit);
  const std::string how = child_->how_it_ended(), crash = child_->crash();
  const bool lost = child_->was_lost();
  WorkedTrial& worked = attempt.worked;
  fill(worked, read_journal(journal.get(), attempt.trial->id, true));
  worked.record.end = crash.empty() ? "protocol_error" : crash;
  worked.record.message =
      "its worker " + (crash.empty() ? std::string("closed the connection") : how) + attempt.after_steps();
  attempt.fate = lost ? Fate::lost : Fate::blamed;
  stop_worker(0);
}

}  // namespace relign::runner
