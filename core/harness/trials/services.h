// The services of a trial (relign/services.h): what it offers to one algorithm besides moves and captures.
// Each is null unless the view's algorithm may observe what the service needs.
//
// Services do not stop the algorithm's clock: their time counts as if the algorithm had done the work itself.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "plugin_host/service_tables.h"
#include "trials/measure_table.h"
#include "trials/trial_view.h"

namespace relign::trials {

class TrialHost;
class ModelService;
class RunService;
struct SimulatedLens;

// State that the functions of one view's services share; the context of every table.
struct ServiceContext {
  ServiceContext(TrialHost& trial, TrialView& own);
  ~ServiceContext();

  relign_status refuse(const std::string& reason) {
    why = reason;
    return RELIGN_BAD_ARGUMENT;
  }
  bool is_pose(const double* values, std::uint32_t axes) const;
  bool grants(std::uint32_t bits) const { return (view.table().task->observes & bits) == bits; }
  const SimulatedLens* simulated_lens() const;  // null on a station

  TrialHost& host;
  TrialView& view;
  std::string why;       // of the last refusal
  FieldMeasures fields;  // the last
  std::unique_ptr<ModelService> model;
  std::unique_ptr<RunService> run;
  std::thread::id thread = std::this_thread::get_id();
};

// Each service: fills its table, except struct_size and context, and returns whether the algorithm gets it.
bool offer(ServiceContext& shared, relign_model_service& table);  // model_service.cpp
bool offer(ServiceContext& shared, relign_run_service& table);    // run_service.cpp

relign_status write_text(const relign_text_sink* sink, std::string_view text);

class Services {
 public:
  Services(TrialHost& host, TrialView& view) : shared_(host, view) {}
  Services(const Services&) = delete;
  Services& operator=(const Services&) = delete;

  const void* get(std::string_view id);
  relign_status why(const relign_text_sink* reason) const { return write_text(reason, shared_.why); }

 private:
  ServiceContext shared_;
  plugin_host::ServiceTables tables_;
};

}  // namespace relign::trials
