// Services of a trial (relign/services.h) as requests of a process; docs/process_plugins.md lists them.
#pragma once

#include <relign/plugin.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

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

  // For the answers of each service: arguments of the request, which end it with "refused" if they are unusable.
  std::string call() const { return text("call"); }
  std::string text(const char* member) const;    // "" when it is missing
  std::string object(const char* member) const;  // as JSON text; "{}" when it is missing
  template <class Integer>
  Integer integer(const char* member) const;
  std::vector<double> numbers(const char* member) const;  // NaN for anything else
  std::vector<std::uint32_t> regions(const char* member) const;
  std::vector<std::uint32_t> counts(const char* member) const;
  relign_model_lens* lens(const char* member) const;
  relign_text bytes(const char* member) const;  // that the process wrote into the room which it requested before

  // Results.
  std::uint32_t axes() const { return trial_.task->axes; }
  // Behind the trial's images. Several images overwrite the room for bytes.
  float* pixels(std::uint32_t width, std::uint32_t height, std::size_t images = 1);
  Json place_of_pixels() const;
  Json room();                         // for bytes of the process, behind the pixels
  Json give(const std::string& data);  // to the process, in the same place
  std::uint64_t keep(relign_model_lens* lens);
  void forget(relign_model_lens* lens);
  void share_image(const relign_image& image);  // the latest one
  Json failure(relign_status status) const;     // any status but RELIGN_OK, with the service's message
  Json unknown_call() const;

 private:
  const void* service(const char* id) const;  // null when not offered
  std::size_t data_offset() const;
  Json place_of_data(std::size_t bytes) const;

  const relign_trial& trial_;
  SharedPixels& pixels_;
  std::size_t image_bytes_;
  const Json* request_ = nullptr;
  std::map<std::uint64_t, relign_model_lens*> lenses_;  // by the number that the process uses
  std::uint64_t lenses_made_ = 0;
  std::size_t data_room_ = 0;  // bytes behind the pixels reserved for data of the process
};

}  // namespace relign::plugin_host
