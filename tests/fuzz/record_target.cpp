// Lines of trials/ and times/.
#include "records/line_files.h"
#include "records/step_numbers.h"
#include "resealed.h"
#include "target.h"

using namespace relign;

namespace {

bool same(double a, double b) { return a == b || (a != a && b != b); }

// Of a key that stands twice in a step's line one reader takes the first, the other the last value.
bool has_key_twice(const std::string& line) {
  for (const char* key : {"step", "measured", "machine_seconds", "recommendation", "recommended_seconds",
                          "recommended_true_pose", "commanded_mse", "recommended_mse"}) {
    const std::string quoted = std::string("\"") + key + "\"";
    const std::size_t first = line.find(quoted);
    if (first != std::string::npos && line.find(quoted, first + 1) != std::string::npos) return true;
  }
  return line.find("\\u") != std::string::npos;  // keys may be spelt with escapes, too
}

// The quick reader of curves takes every step that the reader of whole records takes, and finds the same numbers.
void check_numbers(const std::string& line) {
  static records::StepNumbersReader reader;
  records::ReadLine whole;
  const bool is_step =
      fuzz::accepted([&] { whole = records::read_trial_line(line, "trials/0000.jsonl:1"); }) && !whole.closing;
  records::StepNumbers numbers;
  const bool read = fuzz::accepted([&] { numbers = reader.read(line, "trials/0000.jsonl:1"); });
  if (!is_step || has_key_twice(line)) return;
  const records::StepRecord& step = whole.step;
  fuzz::demand(read, "numbers of a step that can be read: " + line);
  bool equal = numbers.step == step.step && same(numbers.measured, step.measured) &&
               same(numbers.machine_seconds, step.machine_seconds) &&
               same(numbers.recommended_seconds, step.recommended_seconds) &&
               same(numbers.commanded_mse, step.commanded_mse) && same(numbers.recommended_mse, step.recommended_mse) &&
               numbers.recommendation == step.recommendation &&
               numbers.recommended_true_pose.size() == step.recommended_true_pose.size();
  for (std::size_t axis = 0; equal && axis < step.recommended_true_pose.size(); ++axis)
    equal = same(numbers.recommended_true_pose[axis], step.recommended_true_pose[axis]);
  fuzz::demand(equal, "the same numbers from both readers: " + line);
}

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
  check_numbers(text.substr(0, text.find('\n')));
  for (const std::string& lines : {text, records::resealed(text)}) {
    fuzz::accepted([&] {
      const records::Blocks split = records::split_trials(lines, "trials/0000.jsonl");
      fuzz::demand(split.whole <= lines.size(), "what is whole is in the text");
      for (const records::Block& block : split.blocks) records::read_block(block, "trials/0000.jsonl");
    });
    fuzz::accepted([&] { records::split_times(lines, "times/0000.jsonl"); });
  }
  return 0;
}
