// Lines of trials/ and times/.
#include "records/line_files.h"
#include "target.h"

using namespace relign;

namespace {

void check_line(const std::string& line) {
  fuzz::accepted([&] {
    const records::ReadLine read = records::read_trial_line(line, "trials/0000.jsonl:1");
    const std::string written =
        read.closing ? records::closing_line(read.trial, read.steps) : records::step_line(read.trial.trial, read.step);
    const records::ReadLine again = records::read_trial_line(written, "what was written");
    fuzz::demand(written == (again.closing ? records::closing_line(again.trial, again.steps)
                                           : records::step_line(again.trial.trial, again.step)),
                 "a line that is written as it was read: " + written);
  });
  fuzz::accepted([&] {
    const std::string written = records::to_line(records::read_times_line(line, "times/0000.jsonl:1"));
    fuzz::demand(written == records::to_line(records::read_times_line(written, "what was written")),
                 "times that are written as they were read: " + written);
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  check_line(text.substr(0, text.find('\n')));
  fuzz::accepted([&] {
    const records::Blocks split = records::split_trials(text, "trials/0000.jsonl");
    fuzz::demand(split.whole <= text.size(), "what is whole is in the text");
    for (const records::Block& block : split.blocks) records::read_block(block, "trials/0000.jsonl");
  });
  fuzz::accepted([&] { records::split_times(text, "times/0000.jsonl"); });
  return 0;
}
