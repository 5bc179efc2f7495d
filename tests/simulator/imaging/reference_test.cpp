// The cache of O*: indexed by content and rendering code, and verified on reading.
#include "imaging/reference.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "base/files.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

namespace fs = std::filesystem;

class ReferenceTest : public testing::Test {
 protected:
  ReferenceTest() : folder_(fs::temp_directory_path() / ("relign-reference-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~ReferenceTest() override { fs::remove_all(folder_); }

  Reference make(const SceneFile& scene, const fs::path& folder, const std::string& renderer) {
    return make_reference(scene, {}, parallel_, {folder, renderer},
                          [this](const std::string& text) { warnings_.push_back(text); });
  }
  std::vector<fs::path> cached() const { return {fs::directory_iterator(folder_), fs::directory_iterator()}; }
  // Twenty pixels a side are rendered quickly.
  static SceneFile small_scene(double ambient_index = 1) {
    SceneChoices choices;
    choices.pixels = 20;
    choices.ambient_index = ambient_index;
    return read_scene_file(std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/relign_od/scene.json",
                           choices);
  }

  fs::path folder_;
  Parallel parallel_{1};
  std::vector<std::string> warnings_;
};

TEST_F(ReferenceTest, RoundTripsBitForBit) {
  const Reference rendered = make(small_scene(), folder_, "a");
  ASSERT_EQ(cached().size(), 1u);
  const Reference read = make(small_scene(), folder_, "a");
  EXPECT_EQ(rendered.first, read.first);
  EXPECT_EQ(rendered.second, read.second);
  EXPECT_EQ(rendered.mean, read.mean);
  EXPECT_NE(rendered.first, rendered.second) << "the two renders are independent";
}

TEST_F(ReferenceTest, DependsOnSceneAndCode) {
  make(small_scene(), folder_, "a");
  make(small_scene(), folder_, "b");
  EXPECT_EQ(cached().size(), 2u);
  make(small_scene(1.000277), folder_, "a");
  EXPECT_EQ(cached().size(), 3u);
}

TEST_F(ReferenceTest, RendersAgainAfterDamage) {
  const Reference rendered = make(small_scene(), folder_, "a");
  const fs::path file = cached().at(0);
  std::string content = read_file(file);
  content[content.size() / 2] ^= 1;
  write_file_atomically(file, content);
  EXPECT_EQ(make(small_scene(), folder_, "a").first, rendered.first);
  EXPECT_NE(read_file(file), content) << "written anew";
  write_file_atomically(file, "short");
  EXPECT_EQ(make(small_scene(), folder_, "a").first, rendered.first);
}

TEST_F(ReferenceTest, WarnsIfTheFolderIsNotWritable) {
  EXPECT_EQ(make(small_scene(), "/proc/relign", "a").first.size(), 400u);
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_NE(warnings_[0].find("/proc/relign"), std::string::npos) << warnings_[0];
}

}  // namespace
}  // namespace relign::imaging
