// Checksums of records, and damaged bytes in the files of a results folder.
#include "records/damage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "base/files.h"
#include "base/hash.h"
#include "error_text.h"
#include "records/checksum.h"
#include "records/line_files.h"
#include "records/results_folder.h"
#include "records/stored_trials.h"
#include "sample_records.h"

namespace relign::records {
namespace {

namespace fs = std::filesystem;
using test::error_text;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::UnorderedElementsAre;

const char* const kIds[] = {"00000000000000aa", "00000000000000bb", "00000000000000cc"};

TEST(Checksum, IsTheHashOfTheLinesWithoutIt) {
  const std::string lines = to_lines(sample_trial("aa"));
  const std::string sealed = with_checksum(lines);
  EXPECT_EQ(sealed.substr(0, lines.size() - 1), lines.substr(0, lines.size() - 1));
  EXPECT_EQ(sealed.substr(lines.size() - 1), ",\"sha256\":\"" + sha256_hex(lines + "\n") + "\"}");
  EXPECT_EQ(without_checksum(sealed), lines);
  EXPECT_EQ(without_checksum(sealed + "\n"), lines + "\n");
  EXPECT_EQ(without_checksum(lines), lines);
  EXPECT_TRUE(line_is_intact(with_checksum(to_line(sample_times("aa")))));
  EXPECT_FALSE(line_is_intact(to_line(sample_times("aa"))));
}

class Damaged : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fill(folder_ / "a");
    trials_ = read_file(folder_ / "a/trials/0000.jsonl");
    times_ = read_file(folder_ / "a/times/0000.jsonl");
  }
  void TearDown() override { fs::remove_all(folder_); }

  static void fill(const fs::path& folder) {
    ResultsWriter writer(folder);
    for (std::size_t place = 0; place < std::size(kIds); ++place) {
      TrialRecord record = sample_trial(kIds[place]);
      record.instance = place;
      writer.append(place, record, sample_times(kIds[place]));
    }
    writer.write_manifest({});
  }
  void write(const std::string& trials) { write_file_atomically(folder_ / "a/trials/0000.jsonl", trials); }
  std::vector<std::string> intact() const {
    std::vector<std::string> ids;
    std::vector<Damage> damaged;
    for_each_with_steps(
        folder_ / "a",
        [&](const TrialRecord& closing, const StoredTrial&, const std::vector<StepNumbers>& steps) {
          EXPECT_EQ(steps.size(), 3U);
          ids.push_back(closing.trial);
        },
        {}, &damaged);
    return ids;
  }
  // What a run with --drop-damaged leaves.
  std::set<std::string> kept() const {
    return ResultsWriter(folder_ / "a", ResultsWriter::OnDamage::drop).finished_trials();
  }
  const fs::path folder_ = fs::temp_directory_path() / ("relign-damage-" + std::to_string(::getpid()));
  std::string trials_, times_;
};

TEST_F(Damaged, IntactRecordsAreRead) { EXPECT_THAT(intact(), ElementsAre(kIds[0], kIds[1], kIds[2])); }

// One changed byte anywhere in the second trial: it is never taken for whole, and the others are not lost.
TEST_F(Damaged, EveryChangedByteIsFound) {
  const std::size_t begin = trials_.find(kIds[1]) - 10, end = trials_.find(kIds[2]) - 10;
  ASSERT_EQ(trials_[begin], '{');
  const auto check = [&](std::size_t at, char byte) {
    if (trials_[at] == byte) return;
    std::string changed = trials_;
    changed[at] = byte;
    const Blocks split = split_trials(changed, "f");
    ASSERT_THAT(split.damaged, Not(IsEmpty())) << at << " " << int{byte};
    ASSERT_EQ(split.whole, changed.size()) << at;
    std::vector<std::string> ids, expected = {kIds[0], kIds[2]};
    if (at + 1 == end) expected.pop_back();  // without its newline the block is joined with the next one
    for (const Block& block : split.blocks) ids.push_back(block.trial);
    ASSERT_EQ(ids, expected) << at << " " << int{byte};
  };
  constexpr char kBytes[] = {'0', '"', '\n', '\0'};
  for (std::size_t at = begin; at < end; ++at) {
    check(at, kBytes[at % 4]);
    if (trials_[at] == '\n')
      for (const char byte : kBytes) check(at, byte);
  }
}

TEST_F(Damaged, EveryChangedByteOfTimesIsFound) {
  const std::string line = times_.substr(0, times_.find('\n'));
  for (std::size_t at = 0; at < line.size(); ++at)
    for (const char byte : {'0', '"', '}'}) {
      if (line[at] == byte) continue;
      std::string changed = times_;
      changed[at] = byte;
      const Blocks split = split_times(changed, "f");
      ASSERT_THAT(split.damaged, SizeIs(1)) << at;
      ASSERT_THAT(split.blocks, SizeIs(2)) << at;
    }
}

TEST_F(Damaged, ReadersNameTheTrialAndItsLine) {
  std::string changed = trials_;
  changed[changed.find("\"measured\":0.04", changed.find(kIds[1])) + 13] = '9';
  write(changed);
  const auto named = AllOf(HasSubstr("a/trials/0000.jsonl:8: trial 00000000000000bb is damaged: its lines do not have "
                                     "the checksum on its closing line"),
                           HasSubstr("--drop-damaged"));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { read_trials(folder_ / "a"); }), named);
  EXPECT_THAT(error_text(ErrorKind::bad_input,
                         [&] {
                           for_each_with_steps(folder_ / "a", [](const TrialRecord&, const StoredTrial&,
                                                                 const std::vector<StepNumbers>&) {});
                         }),
              named);
  EXPECT_THAT(intact(), ElementsAre(kIds[0], kIds[2]));
}

TEST_F(Damaged, ARunChangesNothingUnlessAsked) {
  std::string changed = trials_;
  changed[changed.find("\"measured\":0.04", changed.find(kIds[1])) + 13] = '9';
  changed += "{\"trial\":\"half";
  write(changed);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { ResultsWriter writer(folder_ / "a"); }), HasSubstr(kIds[1]));
  EXPECT_EQ(read_file(folder_ / "a/trials/0000.jsonl"), changed);
  {
    ResultsWriter writer(folder_ / "a", ResultsWriter::OnDamage::drop);
    EXPECT_THAT(writer.finished_trials(), ElementsAre(kIds[0], kIds[2]));
    ASSERT_THAT(writer.dropped(), SizeIs(1));
    EXPECT_EQ(writer.dropped()[0].trial, kIds[1]);
    TrialRecord again = sample_trial(kIds[1]);
    again.instance = 1;
    writer.append(1, again, sample_times(kIds[1]));
    writer.finish({kIds[0], kIds[1], kIds[2]});
  }
  EXPECT_EQ(read_file(folder_ / "a/trials/0000.jsonl"), trials_);
  EXPECT_EQ(read_file(folder_ / "a/times/0000.jsonl"), times_);
}

TEST_F(Damaged, DamageAtTheEndIsNotTakenForHalfWritten) {
  std::string changed = trials_;
  changed[changed.size() - 90] = '\x01';  // in the last closing line
  write(changed);
  EXPECT_THROW(ResultsWriter writer(folder_ / "a"), Error);
  EXPECT_EQ(read_file(folder_ / "a/trials/0000.jsonl"), changed);
  EXPECT_THAT(kept(), ElementsAre(kIds[0], kIds[1]));
}

TEST_F(Damaged, ZeroedPageLosesOnlyWhatItCovers) {
  std::string changed = trials_;
  const std::size_t begin = trials_.find(kIds[1]);
  changed.replace(begin + 100, 700, 700, '\0');
  write(changed);
  EXPECT_THAT(intact(), ElementsAre(kIds[0], kIds[2]));
  EXPECT_THAT(kept(), ElementsAre(kIds[0], kIds[2]));
}

TEST_F(Damaged, TimesAreNamedAndTheirTrialLosesItsPlugins) {
  std::string changed = times_;
  changed[changed.find("0.25")] = '7';
  write_file_atomically(folder_ / "a/times/0000.jsonl", changed);
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { ResultsWriter writer(folder_ / "a"); }),
              HasSubstr("a/times/0000.jsonl:1: the times of trial 00000000000000aa are damaged: the line does not have "
                        "its checksum"));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { for_each_times(folder_ / "a", [](const TrialTimes&) {}); }),
              HasSubstr("0000.jsonl:1"));
  const ResultsWriter writer(folder_ / "a", ResultsWriter::OnDamage::drop);
  EXPECT_THAT(writer.finished_trials(), SizeIs(3));
  EXPECT_EQ(writer.finished().at(kIds[0]).plugins.algorithm, "") << "which makes a run repeat the trial";
}

TEST_F(Damaged, RecordsWithoutChecksumsAreDamaged) {
  const std::string second(split_trials(trials_, "f").blocks[1].text);
  std::string changed = trials_;
  write(changed.replace(changed.find(second), second.size(), without_checksum(second)));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { ResultsWriter writer(folder_ / "a"); }),
              HasSubstr("a/trials/0000.jsonl:8: trial 00000000000000bb is damaged: its closing line has no checksum"));
  EXPECT_THAT(intact(), ElementsAre(kIds[0], kIds[2]));
  write_file_atomically(folder_ / "a/times/0000.jsonl", without_checksum(times_));
  EXPECT_THAT(split_times(read_file(folder_ / "a/times/0000.jsonl"), "f").damaged, SizeIs(1));
  EXPECT_THAT(kept(), ElementsAre(kIds[0], kIds[2]));
}

}  // namespace
}  // namespace relign::records
