// What a worker, or a plugin that scribbled over it, left in a trial's journal.
#include <sys/mman.h>
#include <unistd.h>

#include "runner/trial_journal.h"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const int file = ::memfd_create("journal", MFD_CLOEXEC);
  fuzz::demand(::ftruncate(file, 0) == 0 && ::pwrite(file, data, size, 0) == static_cast<ssize_t>(size), "memory");
  for (const bool checked : {false, true})
    fuzz::accepted([&] {
      const runner::Journal journal = runner::read_journal(file, "0123456789abcdef", checked);
      fuzz::demand(journal.size == size, "all bytes counted");
      fuzz::demand(journal.times.algorithm_seconds.size() == journal.steps &&
                       journal.times.truth_seconds.size() == journal.steps,
                   "a time for every step");
      if (!checked) return;
      // Steps that were checked can be read again.
      std::size_t read = 0;
      for (std::size_t at = 0; at < journal.step_lines.size(); ++read) {
        const std::size_t end = journal.step_lines.find('\n', at);
        fuzz::demand(!records::read_trial_line(journal.step_lines.substr(at, end - at), "a step").closing, "a step");
        at = end + 1;
      }
      fuzz::demand(read == journal.steps, "as many lines as steps");
    });
  return 0;
}
