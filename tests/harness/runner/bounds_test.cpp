// The bound of one more image, stored with the results.
#include "runner/bounds.h"

#include <algorithm>

#include "base/hash.h"
#include "toy_suites.h"

namespace relign::runner {
namespace {

class BoundsTest : public ToyTest {
 protected:
  static std::string suite(const std::string& scene_parameters, const std::string& more = "") {
    return R"({"scenes": [{"use": "toy-scene", "name": "toy", "parameters": )" + scene_parameters +
           R"(}], "noise_levels": ["toy-level", "toy-wild"], "instances": 3, "steps": 2, "algorithms": ["toy-walker"])" +
           more + "}";
  }
  std::vector<fs::path> bounds(const std::string& name) const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / name))
      if (entry.path().parent_path().filename() == "next_image") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
  }
};

TEST_F(BoundsTest, CoverEveryLevelOnItsFirstInstances) {
  run(prepared(suite(R"({"tells_optimum": true})")), options("a"));
  const std::vector<fs::path> files = bounds("a");
  ASSERT_EQ(files.size(), 2U);
  EXPECT_EQ(files[0].filename(), "toy-level.json");
  const Json written = Json::parse(read_file(files[1]));
  EXPECT_EQ(written["format"], 1);
  EXPECT_EQ(written["noise_level"], "toy-wild");
  ASSERT_EQ(written["lenses"].size(), 2U);
  EXPECT_EQ(written["lenses"][1]["instance"], 1);
  // Uniform noise of 0.01 on 96 pixels, two axes; eight captures give its variance to a few per cent.
  for (const Json& lens : written["lenses"])
    EXPECT_NEAR(lens["excess_mse"].get<double>(), 2 * 1e-4 / 96, 0.4 * 2 * 1e-4 / 96) << lens;
  EXPECT_TRUE(messages_.empty());
}

TEST_F(BoundsTest, AreKeptUntilTheInstancesChange) {
  run(prepared(suite(R"({"tells_optimum": true})")), options("a"));
  const fs::path file = bounds("a").front();
  const std::string before = read_file(file);
  const auto written = fs::last_write_time(file);
  run(prepared(suite(R"({"tells_optimum": true})")), options("a"));
  EXPECT_EQ(fs::last_write_time(file), written);
  run(prepared(suite(R"({"tells_optimum": true})", R"(, "seed": 5)")), options("b"));
  EXPECT_NE(read_file(bounds("b").front()), before);
  fs::copy_file(file, bounds("b").front(), fs::copy_options::overwrite_existing);
  const std::string other = read_file(bounds("b").back());
  run(prepared(suite(R"({"tells_optimum": true})", R"(, "seed": 5)")), options("b"));
  EXPECT_NE(read_file(bounds("b").front()), before) << "instances of another seed";
  EXPECT_EQ(read_file(bounds("b").back()), other);
}

// Cached results are used if they are complete and of the same scene, level and instances; else they are computed
// again.
TEST_F(BoundsTest, AndLandscapesAreCachedBetweenRuns) {
  const PreparedPlan plan = prepared(suite(R"({"tells_optimum": true})"));
  const auto run_into = [&](const std::string& name) {
    RunOptions with_cache = options(name);
    with_cache.cache_folder = folder_ / "cache";
    run(plan, with_cache);
    std::map<std::string, std::string> files;
    for (const auto& [file, bytes] : contents(name))
      if (file.rfind("scenes/", 0) == 0) files[fs::path(file).filename().string()] = bytes;
    return files;
  };
  const auto first = run_into("a");
  EXPECT_EQ(run_into("b"), first);
  std::map<std::string, fs::path> kept;  // by kind
  for (const char* kind : {"landscape", "next_image"})
    for (const auto& entry : fs::directory_iterator(folder_ / "cache" / kind)) {
      kept[kind] = entry.path();
      Json changed = Json::parse(read_file(entry.path()));
      Json& value = changed["value"];
      (kind == std::string("landscape") ? value["lines"][0]["mse"][0] : value[0]["excess_mse"]) = 42.5;
      changed["sha256"] = sha256_hex(canonical_json(value));
      write_file_atomically(entry.path(), changed.dump());
    }
  ASSERT_EQ(kept.size(), 2U);
  const auto of_changed = run_into("c");
  EXPECT_THAT(of_changed.at("landscape.json"), testing::HasSubstr("42.5"));
  EXPECT_THAT(of_changed.at("toy-level.json"), testing::HasSubstr("42.5"));
  for (const char* kind : {"landscape", "next_image"})
    for (const auto& entry : fs::directory_iterator(folder_ / "cache" / kind)) {
      std::string damaged = read_file(entry.path());
      damaged.replace(damaged.find("42.5"), 4, "43.5");
      write_file_atomically(entry.path(), damaged);
    }
  EXPECT_EQ(run_into("d"), first);
  write_file_atomically(kept["landscape"], "{");
  EXPECT_EQ(run_into("e"), first);
}

TEST_F(BoundsTest, AreWrittenByOneShard) {
  const PreparedPlan plan = prepared(suite(R"({"tells_optimum": true})"));
  RunOptions first = options("first"), second = options("second");
  first.only = {{"instance", "0"}};
  second.only = {{"instance", "1"}, {"instance", "2"}};
  run(plan, first);
  run(plan, second);
  EXPECT_EQ(bounds("first").size(), 2U);
  EXPECT_TRUE(bounds("second").empty());
}

TEST_F(BoundsTest, AreMissingIfTheSceneFails) {
  run(prepared(suite("{}")), options("silent"));
  EXPECT_TRUE(bounds("silent").empty());
  run(prepared(suite(R"({"tells_optimum": true, "broken_above": -1})")), options("broken"));
  EXPECT_TRUE(bounds("broken").empty());
  EXPECT_THAT(messages_, testing::Contains(testing::HasSubstr("no bound of one more image for toy")));
}

}  // namespace
}  // namespace relign::runner
