// For tests: does what plugins must not do, chosen by a parameter.
#include <locale.h>
#include <unistd.h>
#include <xmmintrin.h>

#include <cfenv>
#include <clocale>
#include <csignal>
#include <locale>
#include <new>
#include <relign/plugin.hpp>

namespace {

constexpr unsigned kFlushToZero = 0x8000;

void flush_to_zero() { _mm_setcsr(_mm_getcsr() | kFlushToZero); }

class Misbehaving final : public relign::Optimizer {
 public:
  explicit Misbehaving(const relign::Parameters& given) : deed_(given.text("deed")) {
    if (deed_ == "fail in create") throw std::runtime_error("made to fail");
    if (deed_ == "flush to zero in create") flush_to_zero();
  }

  void run(relign::Trial& trial) override {
    if (deed_ == "flush to zero") flush_to_zero();
    if (deed_ == "flush to zero and step") {
      flush_to_zero();
      trial.step(trial.box().centre());
      if (!(_mm_getcsr() & kFlushToZero)) throw std::runtime_error("the host took my floating-point mode");
    }
    if (deed_ == "rounding") std::fesetround(FE_UPWARD);
    if (deed_ == "folder" && ::chdir("/") != 0) throw std::runtime_error("chdir");
    if (deed_ == "locale") std::setlocale(LC_ALL, "C.UTF-8");
    if (deed_ == "thread locale") ::uselocale(::newlocale(LC_ALL_MASK, "C", nullptr));
    if (deed_ == "c++ locale") std::locale::global(std::locale(std::locale(), new std::numpunct<char>));
    if (deed_ == "signal") std::signal(SIGUSR2, SIG_IGN);
    if (deed_ == "throw") throw std::runtime_error("thrown on purpose");
    if (deed_ == "throw an int") throw 7;
    if (deed_ == "run out of memory") throw std::bad_alloc();
  }

 private:
  std::string deed_;
};

}  // namespace

RELIGN_PLUGIN(Misbehaving)
