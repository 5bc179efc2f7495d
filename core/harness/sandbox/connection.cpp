#include "sandbox/connection.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>

#include "base/error.h"
#include "base/json_members.h"
#include "plugin_host/process_child.h"

namespace relign::sandbox {
namespace {

using plugin_host::ChildProcess;

// More than there will ever be (1 GiB of pretrained data behind three images): the file grows below it.
constexpr std::size_t kAddresses = std::size_t{8} << 30;

int descriptor(const char* name) {
  const char* text = std::getenv(name);
  const int number = text ? std::atoi(text) : -1;
  if (number < 0 || ::fcntl(number, F_GETFD) < 0)
    throw Error(ErrorKind::bad_input, "'relign-library-host' is an internal program of relign-bench");
  ::fcntl(number, F_SETFD, FD_CLOEXEC);
  return number;
}

}  // namespace

Connection::Connection()
    : Connection(descriptor("RELIGN_FROM_HOST_FD"), descriptor("RELIGN_TO_HOST_FD"),
                 ChildProcess::childs_pixel_file()) {}

Connection::Connection(int in, int out, int shared) : in_(in), out_(out), shared_(shared) {
  void* const mapped = ::mmap(nullptr, kAddresses, PROT_READ, MAP_SHARED | MAP_NORESERVE, shared_, 0);
  if (mapped == MAP_FAILED) throw Error(ErrorKind::internal, "cannot map the shared memory");
  mapped_ = static_cast<const char*>(mapped);
}

void Connection::send_line(std::string_view line) {
  while (!line.empty()) {
    const ssize_t sent = ::send(out_, line.data(), line.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) ::_exit(0);
    line.remove_prefix(static_cast<std::size_t>(sent));
  }
}

void Connection::send(const Json& message) {
  send_line(message.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
}

Json Connection::receive() {
  std::size_t end;
  while ((end = received_.find('\n')) == std::string::npos) {
    char buffer[1 << 14];
    const ssize_t got = ::recv(in_, buffer, sizeof buffer, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) ::_exit(0);
    received_.append(buffer, static_cast<std::size_t>(got));
  }
  line_ = received_.substr(0, end);
  received_.erase(0, end + 1);
  Json message = parsed_json(line_);
  if (!message.is_object() || !member(message, "message").is_string())
    throw Error(ErrorKind::bad_input, "the host sent a malformed message");
  return message;
}

const char* Connection::shared(std::size_t offset, std::uint64_t count, std::size_t size) {
  struct stat file {};
  const bool fits = offset <= kAddresses && count <= (kAddresses - offset) / size;
  if (fits && offset + count * size > bytes_ && ::fstat(shared_, &file) == 0)
    bytes_ = std::min(static_cast<std::size_t>(file.st_size), kAddresses);
  if (!fits || offset + count * size > bytes_)
    throw Error(ErrorKind::bad_input, "the host named bytes that the shared memory does not have");
  return mapped_ + offset;
}

bool Connection::write_shared(std::size_t offset, std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(shared_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    offset += static_cast<std::size_t>(written);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace relign::sandbox
