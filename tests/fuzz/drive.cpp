// Runs a target where libFuzzer is not there: every file of the corpus, then changed ones.
//   fuzz_suite CORPUS... [--inputs N] [--seed S] [--keep FOLDER] [--seconds-each S]
// CORPUS is a file or a folder. An input that ends the program is written to FOLDER (the working directory) first.
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/files.h"
#include "mutate.h"
#include "target.h"

extern "C" void __sanitizer_set_death_callback(void (*)()) __attribute__((weak));

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

const std::string* current = nullptr;
std::string kept_file;

void keep_current() {
  if (!current) return;
  const int file = ::open(kept_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (file < 0) return;
  for (std::size_t done = 0; done < current->size();) {
    const ssize_t written = ::write(file, current->data() + done, current->size() - done);
    if (written <= 0) break;
    done += static_cast<std::size_t>(written);
  }
  ::close(file);
  current = nullptr;
}

void on_signal(int number) {
  keep_current();
  const char text[] = "the input was kept\n";
  if (::write(2, text, sizeof text - 1) < 0) {
  }
  ::signal(number, SIG_DFL);
  ::raise(number);
}

void run(const std::string& input, unsigned seconds, double& slowest) {
  current = &input;
  ::alarm(seconds);
  const auto begin = Clock::now();
  // A copy of its own, so that a sanitizer sees the first byte read beyond it.
  std::vector<std::uint8_t> bytes(input.begin(), input.end());
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  slowest = std::max(slowest, std::chrono::duration<double>(Clock::now() - begin).count());
  current = nullptr;
}

}  // namespace

int main(int count, char** words) {
  std::vector<std::string> files;
  std::uint64_t inputs = 0, seed = 1;
  unsigned seconds_each = 20;
  fs::path keep = ".";
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    const bool has_value = i + 1 < count;
    if (word == "--inputs" && has_value)
      inputs = std::strtoull(words[++i], nullptr, 10);
    else if (word == "--seed" && has_value)
      seed = std::strtoull(words[++i], nullptr, 10);
    else if (word == "--seconds-each" && has_value)
      seconds_each = static_cast<unsigned>(std::strtoul(words[++i], nullptr, 10));
    else if (word == "--keep" && has_value)
      keep = words[++i];
    else if (fs::is_directory(word))
      for (const fs::directory_entry& entry : fs::directory_iterator(word)) files.push_back(entry.path().string());
    else
      files.push_back(word);
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> corpus;
  std::size_t longest = 0;
  try {
    for (const std::string& file : files) corpus.push_back(relign::read_file(file));
  } catch (const relign::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
  for (const std::string& input : corpus) longest = std::max(longest, input.size());
  if (corpus.empty()) {
    std::fprintf(stderr, "name the files to begin with\n");
    return 2;
  }
  kept_file = (keep / ("crash-" + fs::path(words[0]).filename().string())).string();
  for (const int number : {SIGABRT, SIGSEGV, SIGFPE, SIGILL, SIGBUS, SIGALRM}) ::signal(number, on_signal);
  if (__sanitizer_set_death_callback) __sanitizer_set_death_callback(keep_current);

  double slowest = 0;
  for (const std::string& input : corpus) run(input, seconds_each, slowest);
  relign::fuzz::Mutator mutator(seed, corpus, relign::fuzz::words_of(corpus), 2 * longest + 1000);
  const auto begin = Clock::now();
  for (std::uint64_t i = 0; i < inputs; ++i) run(mutator.next(), seconds_each, slowest);
  ::alarm(0);
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  std::printf("%zu files and %llu changed ones, %.0f/s, slowest %.3f s\n", corpus.size(),
              static_cast<unsigned long long>(inputs), inputs == 0 ? 0.0 : static_cast<double>(inputs) / seconds,
              slowest);
  return 0;
}
