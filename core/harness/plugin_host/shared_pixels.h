// Pixels shared by the host and a plugin's process: the process's memory file, mapped into the host.
#pragma once

#include <relign/plugin.h>

#include <cstddef>

namespace relign::plugin_host {

class SharedPixels {
 public:
  // `file` is borrowed; only grow needs it.
  // `first_page` is its first page if it is mapped already (ChildProcess::take_pixels).
  explicit SharedPixels(int file, void* first_page = nullptr);
  ~SharedPixels();
  SharedPixels(const SharedPixels&) = delete;
  SharedPixels& operator=(const SharedPixels&) = delete;

  // Grows the file to at least `bytes` and keeps its contents. False when memory runs out. Invalidates pointers.
  bool grow(std::size_t bytes);
  std::size_t bytes() const { return bytes_; }

  float* at(std::size_t offset_bytes);
  // Copies an image without row padding. False when it needs more than `room_bytes`.
  bool put(const relign_image& image, std::size_t offset_bytes, std::size_t room_bytes);

 private:
  int file_;
  char* mapped_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace relign::plugin_host
