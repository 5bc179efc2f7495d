// An algorithm that is a process of its own: one process per object, one trial per process. The requests
// that come through its messages are answered by the conversation's own functions, in this thread.
#pragma once

#include <relign/plugin.h>

#include <string>

#include "plugin_host/process_plugin.h"

namespace relign::plugin_host {

class ProcessAlgorithm {
 public:
  // Starts the process and gives it its parameters. Throws Error as Algorithm does.
  ProcessAlgorithm(const Choice& choice, const HostServices& services);
  ~ProcessAlgorithm();
  ProcessAlgorithm(const ProcessAlgorithm&) = delete;
  ProcessAlgorithm& operator=(const ProcessAlgorithm&) = delete;

  // Throws Error(plugin_failed), or what a function of `talk` threw.
  void run(const relign_conversation& talk);

 private:
  void begin(const relign_task& task);
  // Answers one request; returns the status that the conversation gave.
  relign_status answer(const Json& request, const relign_conversation& talk);
  void tell(const relign_observation& seen);
  relign_status share_reference(const relign_conversation& talk);
  void share_pixels(const relign_image& image, float* shared);

  ProcessPlugin plugin_;
  std::string line_;  // of the answer, kept for its memory
  std::size_t axes_ = 0;
  float* pixels_ = nullptr;      // mapped, both sides see it: the latest image, then the reference
  std::size_t pixel_bytes_ = 0;  // of one of them
};

}  // namespace relign::plugin_host
