// Services of a trial (relign/services/) as requests of a process; docs/process_plugins.md lists them.
#pragma once

#include <relign/plugin.h>

#include <cstdint>
#include <map>
#include <string>

#include "base/json_source.h"
#include "plugin_host/shared_pixels.h"

namespace relign::plugin_host {

inline constexpr const char* kNoMemoryForPixels = "the host has not enough memory for the shared pixels";

// The services of one trial.
class ProcessServices {
 public:
  // `image_bytes`: size of the latest image at the beginning of `pixels`, and of the reference behind it; 0 when the
  // algorithm does not observe images. `trial` and `pixels` must outlive this object.
  ProcessServices(const relign_trial& trial, SharedPixels& pixels, std::size_t image_bytes);
  ProcessServices(const ProcessServices&) = delete;
  ProcessServices& operator=(const ProcessServices&) = delete;

  // The answer to a request {"message": "service", "service": id, "call": function, ...}: a message "result", "stop",
  // "refused", "failed" or "unsupported". Throws what the service throws.
  Json answer(const Json& request);

 private:
  Json ask_run(const Json& request, const relign_run_service& run);
  Json ask_model(const Json& request, const relign_model_service& model);
  Json ask_lens(const Json& request, const relign_model_service& model, const std::string& call);
  Json ask_prepared(const Json& request, const relign_pretraining_service& prepared);
  const void* service(const char* id) const;  // null when not offered

  const relign_trial& trial_;
  SharedPixels& pixels_;
  std::size_t image_bytes_;
  std::map<std::uint64_t, relign_model_lens*> lenses_;  // by the number that the process uses
  std::uint64_t lenses_made_ = 0;
  std::size_t data_room_ = 0;  // bytes behind the model's pixels reserved for data to save
};

}  // namespace relign::plugin_host
