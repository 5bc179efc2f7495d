#include "plugin_host/shared_pixels.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>

namespace relign::plugin_host {

SharedPixels::SharedPixels(int file, void* first_page) : file_(file), mapped_(static_cast<char*>(first_page)) {
  if (mapped_) bytes_ = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

SharedPixels::~SharedPixels() {
  if (mapped_) ::munmap(mapped_, bytes_);
}

bool SharedPixels::grow(std::size_t bytes) {
  if (bytes <= bytes_) return true;
  if (::ftruncate(file_, static_cast<off_t>(bytes)) != 0) return false;
  // The host has the file mapped: if the process could shrink it, the host would die of SIGBUS.
  ::fcntl(file_, F_ADD_SEALS, F_SEAL_SHRINK);
  void* mapped = mapped_ ? ::mremap(mapped_, bytes_, bytes, MREMAP_MAYMOVE)
                         : ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file_, 0);
  if (mapped == MAP_FAILED) return false;
  mapped_ = static_cast<char*>(mapped);
  bytes_ = bytes;
  return true;
}

float* SharedPixels::at(std::size_t offset_bytes) { return reinterpret_cast<float*>(mapped_ + offset_bytes); }

bool SharedPixels::put(const relign_image& image, std::size_t offset_bytes, std::size_t room_bytes) {
  const std::size_t row_bytes = image.width * sizeof(float);
  if (row_bytes * image.height > room_bytes || offset_bytes + room_bytes > bytes_) return false;
  for (std::size_t y = 0; y < image.height; ++y)
    std::memcpy(mapped_ + offset_bytes + y * row_bytes,
                reinterpret_cast<const char*>(image.pixels) + y * image.row_stride_bytes, row_bytes);
  return true;
}

}  // namespace relign::plugin_host
