// The services of a trial (RELIGN_SERVICE_*): what it offers to one algorithm besides moves and captures.
// Each is null unless the view's algorithm may observe what the service needs.
//
// Services do not stop the algorithm's clock: their time counts as if the algorithm had done the work itself.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "trials/measure_table.h"
#include "trials/trial_view.h"

namespace relign::trials {

class TrialHost;
class ModelService;
class PretrainingService;
class RunService;
struct SimulatedLens;

// State that the functions of one view's services share.
struct ServiceContext {
  ServiceContext(TrialHost& trial, TrialView& own) : host(trial), view(own) {}

  // Runs the body of one service function, which returns a status. Error(bad_input) becomes RELIGN_BAD_ARGUMENT and
  // Error(plugin_failed) RELIGN_FAILED, with the message in `why`; other exceptions propagate and end the trial.
  template <class Body>
  relign_status answer(Body&& body);
  // The same for work that may take long: returns RELIGN_STOP instead once the user has stopped the run.
  template <class Body>
  relign_status answer_unless_stopped(Body&& body);
  relign_status refuse(const std::string& reason) {
    why = reason;
    return RELIGN_BAD_ARGUMENT;
  }
  bool is_pose(const double* values, std::uint32_t axes) const;
  bool grants(std::uint32_t bits) const { return (view.table().task->observes & bits) == bits; }

  TrialHost& host;
  TrialView& view;
  std::string why;       // of the last refusal
  FieldMeasures fields;  // the last
  std::thread::id thread = std::this_thread::get_id();
};

relign_status write_text(const relign_text_sink* sink, std::string_view text);

class Services {
 public:
  Services(TrialHost& host, TrialView& view);
  ~Services();
  Services(const Services&) = delete;
  Services& operator=(const Services&) = delete;

  const void* get(std::string_view id);

 private:
  const SimulatedLens* simulated_lens() const;  // null on a station
  const void* reference();
  const void* measures();
  const void* regions();
  const void* prior();
  const void* history();
  const void* run();
  const void* model();
  const void* prepared();

  ServiceContext shared_;
  relign_reference_service reference_{};
  relign_measures_service measures_{};
  relign_regions_service regions_{};
  relign_prior_service prior_{};
  relign_history_service history_{};
  std::unique_ptr<RunService> run_;
  std::unique_ptr<ModelService> model_;
  std::unique_ptr<PretrainingService> prepared_;
};

}  // namespace relign::trials
