// A plugin's or worker's process that sends the contents of a file whatever it receives, and reads until its input
// ends.
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>

namespace {

int number_in(const char* name) {
  const char* text = std::getenv(name);
  return text ? std::atoi(text) : -1;
}

}  // namespace

int main(int count, char** words) {
  const int to_host = number_in("RELIGN_TO_HOST_FD"), from_host = number_in("RELIGN_FROM_HOST_FD");
  const int file = count > 1 ? ::open(words[1], O_RDONLY | O_CLOEXEC) : -1;
  char buffer[1 << 14];
  for (ssize_t got; (got = ::read(file, buffer, sizeof buffer)) > 0;)
    for (ssize_t done = 0; done < got;) {
      const ssize_t sent = ::send(to_host, buffer + done, static_cast<std::size_t>(got - done), MSG_NOSIGNAL);
      if (sent <= 0) return 0;
      done += sent;
    }
  ::shutdown(to_host, SHUT_WR);
  while (::recv(from_host, buffer, sizeof buffer, 0) > 0) {
  }
  return 0;
}
