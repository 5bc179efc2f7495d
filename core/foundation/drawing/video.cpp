#include "drawing/video.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <sstream>
#include <vector>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"

extern char** environ;

namespace relign::drawing {
namespace {

namespace fs = std::filesystem;

// Runs a program from PATH with its output in `log`. Returns its exit status, or -1 if a signal ended it.
int run_program(const std::vector<std::string>& command, const fs::path& log) {
  std::vector<char*> words;
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t process = 0;
  const int failed = posix_spawnp(&process, words[0], &actions, nullptr, words.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) throw Error(ErrorKind::io, "cannot start '" + command[0] + "': " + std::strerror(failed));
  int status = 0;
  while (waitpid(process, &status, 0) < 0)
    if (errno != EINTR) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

void require_ffmpeg(const std::string& option) {
  if (!program_on_path("ffmpeg").empty()) return;
  throw Error(ErrorKind::bad_input,
              option +
                  ": .mp4 requires ffmpeg, which is not on PATH; install it (Debian and Ubuntu: package ffmpeg) or "
                  "choose .gif");
}

void write_video(const fs::path& out, const std::string& grey, int width, int height, double frames_per_second) {
  const auto beside = [&](const char* ending) {
    return fs::path(out.string() + ".part" + std::to_string(getpid()) + ending);
  };
  const fs::path frames = beside(".grey"), video = beside(".mp4"), log = beside(".log");
  write_file_atomically(frames, grey);
  // Players need even sides and yuv420p; -crf 14 preserves the noise of the captures.
  std::istringstream options("ffmpeg -nostdin -y -loglevel error -f rawvideo -pixel_format gray -video_size " +
                             std::to_string(width) + "x" + std::to_string(height) + " -framerate " +
                             shortest(frames_per_second) +
                             " -i FRAMES -vf pad=ceil(iw/2)*2:ceil(ih/2)*2 -c:v libx264 -crf 14 -pix_fmt yuv420p "
                             "-movflags +faststart");
  std::vector<std::string> command{std::istream_iterator<std::string>(options), {}};
  *std::find(command.begin(), command.end(), "FRAMES") = frames.string();
  command.push_back(video.string());
  const int status = run_program(command, log);
  std::error_code failed;
  const std::string output = fs::exists(log, failed) ? read_file(log) : "";
  if (status == 0) fs::rename(video, out, failed);
  const bool written = status == 0 && !failed;
  std::error_code ignored;
  for (const fs::path& leftover : {frames, video, log}) fs::remove(leftover, ignored);
  if (!written)
    throw Error(ErrorKind::io, out.string() + ": ffmpeg failed (exit status " + std::to_string(status) + ")" +
                                   (output.empty() ? "" : ": " + output));
}

}  // namespace relign::drawing
