#include "cli/film.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <vector>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"

extern char** environ;

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

// Runs a program found on PATH, its output in `log`; its exit status, or -1 when a signal ended it.
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
  if (failed != 0) throw Error(ErrorKind::io, command[0] + " cannot be started: " + std::string(std::strerror(failed)));
  int status = 0;
  while (waitpid(process, &status, 0) < 0)
    if (errno != EINTR) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

void require_film_program() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  std::string folder;
  while (std::getline(folders, folder, ':'))
    if (access((fs::path(folder) / "ffmpeg").c_str(), X_OK) == 0) return;
  throw Error(ErrorKind::bad_input,
              "--out: .mp4 is written by the program ffmpeg, which is not on PATH (Debian and Ubuntu: ffmpeg). "
              "Install it, or choose .gif");
}

void write_film(const fs::path& out, const std::string& grey, int width, int height, double frames_per_second) {
  const auto beside = [&](const char* ending) {
    return fs::path(out.string() + ".part" + std::to_string(getpid()) + ending);
  };
  const fs::path frames = beside(".grey"), film = beside(".mp4"), log = beside(".log");
  write_file_atomically(frames, grey);
  // Players want even sides and yuv420p; -crf 14 keeps the noise that a capture is about.
  const int status = run_program({"ffmpeg",
                                  "-nostdin",
                                  "-y",
                                  "-loglevel",
                                  "error",
                                  "-f",
                                  "rawvideo",
                                  "-pixel_format",
                                  "gray",
                                  "-video_size",
                                  std::to_string(width) + "x" + std::to_string(height),
                                  "-framerate",
                                  shortest(frames_per_second),
                                  "-i",
                                  frames.string(),
                                  "-vf",
                                  "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                                  "-c:v",
                                  "libx264",
                                  "-crf",
                                  "14",
                                  "-pix_fmt",
                                  "yuv420p",
                                  "-movflags",
                                  "+faststart",
                                  film.string()},
                                 log);
  std::error_code failed;
  const std::string words = fs::exists(log, failed) ? read_file(log) : "";
  if (status == 0) fs::rename(film, out, failed);
  const bool written = status == 0 && !failed;
  std::error_code ignored;
  for (const fs::path& leftover : {frames, film, log}) fs::remove(leftover, ignored);
  if (!written)
    throw Error(ErrorKind::io, out.string() + ": ffmpeg wrote no film (exit status " + std::to_string(status) + ")" +
                                   (words.empty() ? "" : ": " + words));
}

}  // namespace relign::cli
