// Pixels that the host and a plugin's process both see: the process's memory file, mapped on this side.
#pragma once

#include <relign/plugin.h>

#include <cstddef>

namespace relign::plugin_host {

class SharedPixels {
 public:
  // `file` is borrowed, and is needed by grow alone.
  explicit SharedPixels(int file) : file_(file) {}
  ~SharedPixels();
  SharedPixels(const SharedPixels&) = delete;
  SharedPixels& operator=(const SharedPixels&) = delete;

  // Makes the file at least so large; what lies in it stays. False when the system has no memory for it. Pointers from
  // before are gone.
  bool grow(std::size_t bytes);
  std::size_t bytes() const { return bytes_; }

  float* at(std::size_t offset_bytes);
  // Copies an image without the gaps between its rows. False when it needs more than `room_bytes`.
  bool put(const relign_image& image, std::size_t offset_bytes, std::size_t room_bytes);

 private:
  int file_;
  char* mapped_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace relign::plugin_host
