#include <signal.h>
#include <unistd.h>
#include <xmmintrin.h>

#include <clocale>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <limits>
#include <relign/plugin.hpp>
#include <string>
#include <thread>
#include <vector>

namespace {

std::vector<char*> leaked;

class ToySaboteur final : public relign::Optimizer {
 public:
  explicit ToySaboteur(const relign::Parameters& given) : deed_(given.text("deed")) {}

  void run(relign::Trial& trial) override {
    relign::Pose pose = trial.first().pose;
    for (int step = 0; step < 2; ++step) {
      pose[0] += 0.01;
      trial.step(pose);
    }
    act(trial, pose);
    while (trial.step(pose)) {
    }
  }

 private:
  void act(relign::Trial& trial, relign::Pose& pose) {
    if (deed_ == "crash") ::raise(SIGSEGV);
    if (deed_ == "abort") std::abort();
    if (deed_ == "hang")
      while (true) ::pause();
    if (deed_ == "eat")
      for (int piece = 0; piece < 1000; ++piece) eat(std::size_t{64} << 20U);
    if (deed_ == "babble") write_to(3, "I am the worker, believe me\n");
    if (deed_ == "scribble") write_to(5, "S{}\n");
    if (deed_ == "overspend")
      while (true) trial.step(pose);
    if (deed_ == "insist") {
      while (true) {
        try {
          trial.step(pose);
        } catch (const std::exception&) {
        }
      }
    }
    if (deed_ == "nan") pose[0] = std::numeric_limits<double>::quiet_NaN();
    if (deed_ == "leave_bounds") pose[0] = 1e9;
    if (deed_ == "floating_point") _mm_setcsr(_mm_getcsr() | 0x8040U);
    if (deed_ == "locale") std::setlocale(LC_ALL, "C.UTF-8");
    if (deed_ == "folder" && ::chdir("/") != 0) throw std::runtime_error("cannot even do that");
    if (deed_ == "handlers") ::signal(SIGTERM, SIG_IGN);
    if (deed_ == "print") {
      std::printf("without a line end");
      std::cout << "\nfrom a stream\n";
      std::fprintf(stderr, "to stderr\n");
    }
    if (deed_ == "exit") std::exit(0);
    if (deed_ == "leak") leaked.push_back(fill(std::size_t{40} << 20U));
    if (deed_ == "start_process") {
      if (::fork() == 0) {
        ::setpgid(0, 0);
        while (true) ::pause();
      }
    }
    if (deed_ == "kill") ::raise(SIGKILL);
  }

  static void write_to(int file, const char* text) {
    if (::write(file, text, std::strlen(text)) < 0) throw std::runtime_error("cannot write");
  }
  static char* fill(std::size_t bytes) {
    char* const memory = new char[bytes];
    std::memset(memory, 1, bytes);
    return memory;
  }
  static void eat(std::size_t bytes) { leaked.push_back(fill(bytes)); }

  std::string deed_;
};

}  // namespace

RELIGN_PLUGIN(ToySaboteur)
