#include "runner/trial_log.h"

#include <gtest/gtest.h>
#include <relign/plugin.h>

namespace relign::runner {
namespace {

TEST(TrialLog, LinesNameSourceAndSeverity) {
  TrialLog log;
  log.add(RELIGN_LOG_INFO, "", "before the trial");
  log.begin();
  log.add(RELIGN_LOG_INFO, "", "printed");
  log.add(RELIGN_LOG_WARNING, "", "the stride grows");
  log.add(RELIGN_LOG_WARNING, "bench", "the lamp flickers");
  log.add(RELIGN_LOG_DEBUG, "bench", "");
  EXPECT_EQ(log.take(), "printed\nwarning: the stride grows\nwarning: bench: the lamp flickers\ndebug: bench: \n");
  log.add(RELIGN_LOG_INFO, "", "after it");
  log.begin();
  EXPECT_EQ(log.take(), "");
}

TEST(TrialLog, CutsAndCountsExcessOutput) {
  TrialLog log;
  log.begin();
  const std::string line(99, 'x');  // 100 bytes with its end
  for (int i = 0; i < 20000; ++i) log.add(RELIGN_LOG_INFO, "", line);
  log.add(RELIGN_LOG_INFO, "", "");  // would fit, but the log must have no gaps
  const std::string text = log.take();
  const std::string closing = "(cut here: 9516 more lines, 951501 bytes)\n";
  ASSERT_EQ(text.size(), 10485 * 100 + closing.size()) << text.substr(text.size() - 60);
  EXPECT_EQ(text.substr(10485 * 100), closing);

  log.begin();
  log.add(RELIGN_LOG_INFO, "", std::string(TrialLog::kMaxBytes, 'y'));
  EXPECT_EQ(log.take(), "(cut here: 1 more line, 1048577 bytes)\n");
}

}  // namespace
}  // namespace relign::runner
