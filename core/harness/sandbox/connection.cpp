#include "sandbox/connection.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

#include "base/error.h"
#include "plugin_host/process_child.h"

namespace relign::sandbox {
namespace {

using plugin_host::ChildProcess;

int descriptor(const char* name) {
  const char* text = std::getenv(name);
  const int number = text ? std::atoi(text) : -1;
  if (number < 0 || ::fcntl(number, F_GETFD) < 0)
    throw Error(ErrorKind::bad_input, "'relign-library-host' is an internal program of relign-bench");
  ::fcntl(number, F_SETFD, FD_CLOEXEC);
  return number;
}

}  // namespace

Connection::Connection() : in_(descriptor("RELIGN_FROM_HOST_FD")), out_(descriptor("RELIGN_TO_HOST_FD")) {
  // More than there will ever be (1 GiB of pretrained data behind three images): the file grows below it.
  constexpr std::size_t kAddresses = std::size_t{8} << 30;
  void* const mapped =
      ::mmap(nullptr, kAddresses, PROT_READ, MAP_SHARED | MAP_NORESERVE, ChildProcess::childs_pixel_file(), 0);
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
  return Json::parse(line_);
}

bool Connection::write_shared(std::size_t offset, std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t written =
        ::pwrite(ChildProcess::childs_pixel_file(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    offset += static_cast<std::size_t>(written);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace relign::sandbox
