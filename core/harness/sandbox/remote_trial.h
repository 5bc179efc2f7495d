// A trial whose host is another process: the table that a library gets, with functions that send messages.
#pragma once

#include <relign/plugin.h>

#include <string>
#include <thread>
#include <vector>

#include "sandbox/connection.h"
#include "sandbox/remote_services.h"

namespace relign::sandbox {

class RemoteTrial {
 public:
  // After the message "run", which describes the task.
  RemoteTrial(Connection& connection, const Json& task);
  RemoteTrial(const RemoteTrial&) = delete;
  RemoteTrial& operator=(const RemoteTrial&) = delete;

  const relign_trial& table() const { return table_; }

 private:
  static RemoteTrial& self(void* context) { return *static_cast<RemoteTrial*>(context); }
  relign_status ask(const std::string& line, relign_observation* seen);
  relign_status ask_with_pose(const char* message, const char* member, const double* values, std::uint32_t count,
                              relign_observation* seen);

  Connection& connection_;
  relign_task task_{};
  relign_trial table_{};
  std::string axes_json_, readings_json_;
  std::vector<double> box_lower_, box_upper_;
  const std::thread::id thread_ = std::this_thread::get_id();
  RemoteObservation latest_;
  RemoteServices services_;
};

}  // namespace relign::sandbox
