// An algorithm that is a process of its own: one process per object, one trial per process. The requests
// that come through its messages are answered by the conversation's own functions, in this thread.
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
  // Starts the process and gives it its parameters. Throws Error as Algorithm does.
  ProcessAlgorithm(const Choice& choice, const HostServices& services);
  ProcessAlgorithm(const ProcessAlgorithm&) = delete;
  ProcessAlgorithm& operator=(const ProcessAlgorithm&) = delete;

  // Throws Error(plugin_failed), or what a function of `talk` threw.
  void run(const relign_conversation& talk);

 private:
  void begin(const relign_conversation& talk);
  // Answers one request; returns the status that the conversation gave.
  relign_status answer(const Json& request, const relign_conversation& talk);
  void tell(const relign_observation& seen);
  relign_status share_reference(const relign_conversation& talk);
  void share(const relign_image& image, std::size_t offset_bytes);

  ProcessPlugin plugin_;
  std::string line_;  // of the answer, kept for its memory
  std::size_t axes_ = 0;
  SharedPixels pixels_;          // the latest image, the reference, then what the services need
  std::size_t image_bytes_ = 0;  // of one image; 0 when none is granted
  std::optional<ProcessServices> services_;
};

}  // namespace relign::plugin_host
