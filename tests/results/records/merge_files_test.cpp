// Files, provenance and pictures of merged folders.
#include <fstream>

#include "merge_fixture.h"
#include "records/picture_index.h"

namespace relign::records {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(MergeTest, KeepsForeignFilesWhenReplacingResults) {
  const fs::path a = make("a", {trial("w0")}, manifest({"walker"}, {"w0"}));
  join({a});
  std::ofstream(folder_ / "out/notes.txt") << "mine";
  std::ofstream(folder_ / "out/report.html.relign-tmp-k3Jq0Z") << "half";
  const fs::path b = make("b", {trial("w1")}, manifest({"walker"}, {"w1"}));
  join({a, b});
  EXPECT_THAT(merged(), ElementsAre("w0", "w1"));
  EXPECT_EQ(bytes("out/notes.txt"), "mine");
  EXPECT_FALSE(fs::exists(folder_ / "out/report.html.relign-tmp-k3Jq0Z"));
  // Killed between the two moves: the old folder is not lost.
  fs::rename(folder_ / "out", folder_ / "out.merging.old");
  fs::create_directories(folder_ / "empty");
  EXPECT_THAT(refused({folder_ / "empty"}), HasSubstr("is not a results folder"));
  join({a});
  EXPECT_EQ(bytes("out/notes.txt"), "mine");
  // Killed while writing: the leftovers are removed.
  fs::create_directories(folder_ / "out.merging/trials");
  std::ofstream(folder_ / "out.merging/trials/0007.jsonl") << "half";
  join({a, b});
  EXPECT_FALSE(fs::exists(folder_ / "out/trials/0007.jsonl"));
  EXPECT_FALSE(fs::exists(folder_ / "out.merging"));
  const ResultsLock other_merge(fs::create_directories(folder_ / "out.merging") ? folder_ / "out.merging" : folder_);
  EXPECT_THAT(error_text(ErrorKind::io, [&] { join({a}); }), HasSubstr("another run is writing"));
  EXPECT_EQ(read_trials(folder_ / "out").size(), 2U);
}

TEST_F(MergeTest, KeepsProvenanceWhenMergingMergedFolders) {
  const fs::path a = make("a", {trial("w0")}, manifest({"walker"}, {"w0"}));
  const fs::path b = make("b", {trial("r0")}, manifest({"runner"}, {"r0"}));
  const fs::path c = make("c", {trial("w1")}, manifest({"walker"}, {"w1"}));
  join({a, b}, "first");
  join({folder_ / "first", c});
  EXPECT_THAT(merged(), ElementsAre("w0", "w1", "r0"));
  const Json sources = read_manifest_json(folder_ / "out")["sources"];
  ASSERT_EQ(sources.size(), 3U);
  EXPECT_EQ(sources[1]["folder"], b.string());
  EXPECT_EQ(sources[1]["by_way_of"], (folder_ / "first").string());
  EXPECT_EQ(sources[1]["trials"], 1);
  EXPECT_EQ(sources[2]["trials"], 1);
}

TEST_F(MergeTest, CopiesLogsScenesAndPictures) {
  const auto pictured = [](const std::string& id, const std::string& why) {
    return Json{{"trial", id},
                {"why", why},
                {"frames", {{{"step", 0}, {"file", id + "/step-000.png"}}}},
                {"film", {{"file", id + "/film.webp"}}}};
  };
  const auto with_pictures = [&](const std::string& name, const std::string& id, double mse) {
    TrialRecord record = trial(id);
    record.steps.back().recommended_mse = record.steps.back().commanded_mse = mse;
    const fs::path made = make(name, {record}, manifest({"walker"}, {id}));
    Json index = {
        {"format", 1},
        {"trials", {pictured(id, "best"), pictured(id, "worst")}},
        {"references", {{{"scene", "toy"}, {"file", "toy/reference.png"}}, {{"scene", "x"}, {"file", "../../x"}}}}};
    write_file_atomically(made / "pictures/index.json", completed<PictureIndex>(index).dump());
    write_file_atomically(made / "pictures" / id / "step-000.png", "frame of " + id);
    write_file_atomically(made / "pictures" / id / "film.webp", "film of " + id);
    write_file_atomically(made / "pictures/toy/reference.png", "reference");
    write_file_atomically(made / "scenes/f00/description.json", "{}");
    write_file_atomically(made / "logs" / (id + ".txt"), "log of " + id);
    for (const char* file : {"logs/w0.txt", "scenes/f00/description.json", "pictures/w0/film.webp"})
      write_file_atomically(made / (std::string(file) + ".relign-tmp-x7Yz21"), "of a killed program");
    return made;
  };
  join({with_pictures("a", "w0", 1e-4), with_pictures("b", "w1", 1e-6), with_pictures("c", "w2", 1e-5)});
  EXPECT_EQ(bytes("out/logs/w2.txt"), "log of w2");
  EXPECT_EQ(bytes("out/scenes/f00/description.json"), "{}");
  EXPECT_EQ(bytes("out/pictures/toy/reference.png"), "reference");
  const Json index = Json::parse(bytes("out/pictures/index.json"));
  ASSERT_EQ(index["trials"].size(), 2U);
  EXPECT_EQ(index["trials"][0]["trial"], "w1");  // best
  EXPECT_EQ(index["trials"][1]["trial"], "w0");  // worst
  EXPECT_EQ(index["references"].size(), 1U);
  EXPECT_EQ(bytes("out/pictures/w1/step-000.png"), "frame of w1");
  EXPECT_EQ(bytes("out/pictures/w1/film.webp"), "film of w1");
  EXPECT_FALSE(fs::exists(folder_ / "out/pictures/w2"));
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "out"))
    EXPECT_FALSE(is_temporary_file(entry)) << entry;
}

// An untrusted folder must not bring files of this machine into published results.
TEST_F(MergeTest, DoesNotFollowLinksOutOfTheFolder) {
  write_file_atomically(folder_ / "secret/key.txt", "secret");
  const fs::path made = make("a", {trial("w0")}, manifest({"walker"}, {"w0"}));
  const Json index = {
      {"format", 1},
      {"trials",
       {{{"trial", "w0"},
         {"why", "best"},
         {"frames", {{{"step", 0}, {"file", "w0/step-000.png"}}, {{"step", 1}, {"file", "w0/inner.png"}}}},
         {"film", {{"file", "w0/film.webp"}}}}}},
      {"references", {{{"scene", "toy"}, {"file", "toy/key.txt"}}}}};
  write_file_atomically(made / "pictures/index.json", completed<PictureIndex>(index).dump());
  write_file_atomically(made / "pictures/w0/frame.png", "a frame");
  write_file_atomically(made / "scenes/f00/description.json", "{}");
  fs::create_symlink("frame.png", made / "pictures/w0/inner.png");
  for (const char* link : {"pictures/w0/step-000.png", "pictures/w0/film.webp", "scenes/f00/lens.json"})
    fs::create_symlink(folder_ / "secret/key.txt", made / link);
  fs::create_directory_symlink(folder_ / "secret", made / "pictures/toy");
  fs::create_directories(made / "logs");
  fs::create_symlink(folder_ / "secret/key.txt", made / "logs/w0.txt");
  join({made, make("b", {trial("w1")}, manifest({"walker"}, {"w1"}))});
  EXPECT_EQ(bytes("out/pictures/w0/inner.png"), "a frame");
  EXPECT_EQ(bytes("out/scenes/f00/description.json"), "{}");
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "out"))
    if (entry.is_regular_file()) {
      EXPECT_EQ(read_file(entry.path()).find("secret"), std::string::npos) << entry.path();
    }
}

}  // namespace
}  // namespace relign::records
