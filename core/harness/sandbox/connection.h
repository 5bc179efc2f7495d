// The plugin's side of the messages to a process (docs/process_plugins.md), for library_host.cpp.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "base/json_source.h"

namespace relign::sandbox {

class Connection {
 public:
  Connection();  // by the descriptors in the environment. Throws Error.
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void send_line(std::string_view line);  // with its newline
  void send(const Json& message);
  // The next message. When the host has gone, the process ends.
  Json receive();
  const std::string& last_line() const { return line_; }  // of receive, verbatim

  // The shared memory from `offset` on. It never moves: the library keeps pointers to images in it.
  const char* shared(std::size_t offset) const { return mapped_ + offset; }
  // Writes into it. False when it is too large for the sandbox.
  bool write_shared(std::size_t offset, std::string_view bytes) const;

 private:
  int in_, out_;
  std::string received_, line_;
  const char* mapped_;
};

}  // namespace relign::sandbox
