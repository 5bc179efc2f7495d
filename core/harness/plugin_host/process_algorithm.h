// An algorithm that runs as a process: one process per object, one trial per process. Answers the requests in its
// messages by calling the functions of the trial in this thread.
#pragma once

#include <relign/plugin.h>

#include <optional>
#include <string>

#include "plugin_host/process_plugin.h"
#include "plugin_host/process_services.h"
#include "plugin_host/shared_pixels.h"

namespace relign::plugin_host {

class ProcessAlgorithm {
 public:
  // Starts the process and sends its parameters. Throws Error as Algorithm does.
  ProcessAlgorithm(const Choice& choice, const HostServices& services);
  ProcessAlgorithm(const ProcessAlgorithm&) = delete;
  ProcessAlgorithm& operator=(const ProcessAlgorithm&) = delete;

  // Throws Error(plugin_failed), or what a function of `trial` threw.
  void run(const relign_trial& trial);

 private:
  void begin(const relign_trial& trial);
  // Answers one request. Returns the status of the trial's function.
  relign_status answer(const Json& request, const relign_trial& trial);
  void send_observation(const relign_observation& observation);
  relign_status share_reference(const relign_trial& trial);
  void share(const relign_image& image, std::size_t offset_bytes);

  ProcessPlugin plugin_;
  std::string line_;  // of the answer; a member to reuse its memory
  std::size_t axes_ = 0;
  SharedPixels pixels_;          // the latest image, the reference, then the data of services
  std::size_t image_bytes_ = 0;  // of one image; 0 when the algorithm does not observe images
  std::optional<ProcessServices> services_;
};

}  // namespace relign::plugin_host
