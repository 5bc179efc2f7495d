// The services of a conversation (RELIGN_SERVICE_*): what a trial offers to one algorithm besides moving and looking.
// Each is null unless the seat's algorithm is granted what it needs.
//
// Time spent here is the algorithm's, as if it had done the work itself: services do not stop its clock.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "trials/seat.h"

namespace relign::trials {

class Conversation;
class ModelService;
class PreparedService;
class RunService;

// What the functions of one seat's services share.
struct ServiceSite {
  ServiceSite(Conversation& trial, Seat& own) : host(trial), seat(own) {}

  // Runs the body of one service function, which returns a status. Error(bad_input) becomes RELIGN_BAD_ARGUMENT and
  // Error(plugin_failed) RELIGN_FAILED, each with its sentence; everything else leaves as it is and ends the trial.
  template <class Body>
  relign_status answer(Body&& body);
  // The same for work that may be long: RELIGN_STOP instead once the user stopped the run.
  template <class Body>
  relign_status answer_unless_stopped(Body&& body);
  relign_status refuse(const std::string& sentence) {
    why = sentence;
    return RELIGN_BAD_ARGUMENT;
  }
  bool is_pose(const double* values, std::uint32_t axes) const;
  bool grants(std::uint32_t bits) const { return (seat.table().task->knows & bits) == bits; }

  Conversation& host;
  Seat& seat;
  std::string why;  // of the last refusal
  std::thread::id thread = std::this_thread::get_id();
};

relign_status write_text(const relign_text_sink* sink, std::string_view text);

class Services {
 public:
  Services(Conversation& host, Seat& seat);
  ~Services();
  Services(const Services&) = delete;
  Services& operator=(const Services&) = delete;

  const void* get(std::string_view id);

 private:
  const void* reference();
  const void* measures();
  const void* prior();
  const void* run();
  const void* model();
  const void* prepared();

  ServiceSite site_;
  relign_reference_service reference_{};
  relign_measures_service measures_{};
  relign_prior_service prior_{};
  std::unique_ptr<RunService> run_;
  std::unique_ptr<ModelService> model_;
  std::unique_ptr<PreparedService> prepared_;
};

}  // namespace relign::trials
