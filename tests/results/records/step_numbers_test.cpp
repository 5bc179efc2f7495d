// The fast reader of step numbers agrees with the reader of whole records.
#include "records/step_numbers.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "records/record.h"

using namespace relign;
using namespace relign::records;

namespace {

StepRecord step() {
  StepRecord step;
  step.step = 7;
  step.commanded_pose = step.true_pose = {0.25, 0.75};
  step.measured = 0.1 + 0.2;  // 17 digits
  step.machine_seconds = 1e-300;
  step.recommended_pose = {0.5, 0.5};
  step.recommendation = "best_measured";
  step.recommended_seconds = 12.5;
  step.recommended_true_pose = {0.125, std::nan("")};
  step.commanded_mse = -1e-7;
  step.recommended_mse = std::nan("");
  return step;
}

}  // namespace

TEST(StepNumbers, ReadsStepLines) {
  StepNumbersReader reader;
  const StepNumbers read = reader.read(step_line("00000000000000a0", step()), "a line");
  EXPECT_EQ(read.step, 7);
  EXPECT_EQ(read.measured, 0.1 + 0.2);
  EXPECT_EQ(read.machine_seconds, 1e-300);
  EXPECT_EQ(read.recommendation, "best_measured");
  EXPECT_EQ(read.recommended_seconds, 12.5);
  ASSERT_EQ(read.recommended_true_pose.size(), 2u);
  EXPECT_EQ(read.recommended_true_pose[0], 0.125);
  EXPECT_TRUE(std::isnan(read.recommended_true_pose[1]));
  EXPECT_EQ(read.commanded_mse, -1e-7);
  EXPECT_TRUE(std::isnan(read.recommended_mse));
}

TEST(StepNumbers, ReadsCapturesOfRegions) {
  StepRecord partial = step();
  partial.regions = {{1, 2, 3, 4}, {5, 6, 7, 8}};
  partial.measured = std::nan("");
  StepNumbersReader reader;
  const StepNumbers read = reader.read(step_line("00000000000000a0", partial), "a line");
  EXPECT_TRUE(std::isnan(read.measured));
  EXPECT_EQ(read.machine_seconds, 1e-300);
  EXPECT_EQ(read.commanded_mse, -1e-7);
}

// As other programs write them.
TEST(StepNumbers, ReadsMoreDigitsThanADoubleHas) {
  std::string line = step_line("00000000000000a0", step());
  const std::string found = "\"recommended_seconds\":12.5";
  for (const auto& [text, value] : {std::pair{"0.199999999999999999999999", 0.2},
                                    {"0.00000000000000000000000000125", 1.25e-27},
                                    {"12.50000000000000000000000000000", 12.5},
                                    {"1234567890123456789.5", 1234567890123456789.5}}) {
    SCOPED_TRACE(text);
    std::string other = line;
    other.replace(other.find(found), found.size(), std::string("\"recommended_seconds\":") + text);
    StepNumbersReader reader;
    EXPECT_EQ(reader.read(other, "a line").recommended_seconds, value);
  }
}

TEST(StepNumbers, ReadsAnyMemberOrderAndReportsDamage) {
  StepNumbersReader reader;
  Json json = Json::parse(step_line("00000000000000a0", step()));
  EXPECT_EQ(reader.read(json.dump(), "a line").recommended_seconds, 12.5);  // sorted by key
  json.erase("measured");
  try {
    reader.read(json.dump(), "trials/0000.jsonl:3");
    FAIL() << "a step without its measured error";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).rfind("trials/0000.jsonl:3", 0), 0u) << error.what();
  }
}

// Of two values, this reader would take the first and that of whole records the last.
TEST(StepNumbers, RefusesAKeyThatIsThereTwice) {
  StepNumbersReader reader;
  const std::string line = step_line("00000000000000a0", step());
  for (const char* key :
       {"trial", "step", "true_pose", "limits_low", "merit", "commanded_mse", "recommended_mse_error"})
    for (const char* as : {"", "escaped"}) {
      std::string other = line, name = key;
      if (*as) name.replace(1, 1, "\\u00" + to_hex(name.substr(1, 1)));
      const std::string member = "\"" + std::string(key) + "\":";
      other.insert(other.find(member), "\"" + name + "\":0,");
      SCOPED_TRACE(other);
      try {
        reader.read(other, "trials/0000.jsonl:3");
        ADD_FAILURE() << "accepted";
      } catch (const Error& error) {
        const std::string text = error.what();
        EXPECT_EQ(text.rfind("trials/0000.jsonl:3: the line is damaged: invalid JSON at line 1, column ", 0), 0u)
            << text;
        EXPECT_NE(text.find(std::string("duplicate key '") + key + "'"), std::string::npos) << text;
      }
    }
}
