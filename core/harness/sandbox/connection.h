// The plugin's side of the messages to a process (docs/process_plugins.md), for library_host.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/json_source.h"

namespace relign::sandbox {

class Connection {
 public:
  Connection();  // by the descriptors in the environment. Throws Error.
  Connection(int in, int out, int shared);
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void send_line(std::string_view line);  // with its newline
  void send(const Json& message);
  // The next message, an object. When the host has gone, the process ends. Throws Error(bad_input).
  Json receive();
  const std::string& last_line() const { return line_; }  // of receive, verbatim

  // `count` values of `size` bytes of the shared memory from `offset` on. It never moves: the library keeps pointers to
  // images in it. Throws Error(bad_input) when it has fewer.
  const char* shared(std::size_t offset, std::uint64_t count, std::size_t size);
  // Writes into it. False when it is too large for the sandbox.
  bool write_shared(std::size_t offset, std::string_view bytes) const;

 private:
  int in_, out_, shared_;
  std::size_t bytes_ = 0;  // that the shared memory has at least
  std::string received_, line_;
  const char* mapped_;
};

}  // namespace relign::sandbox
