#include "submissions/evaluation_suite.h"

#include <gmock/gmock.h>

#include <fstream>

#include "refusal.h"

namespace relign::submissions {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class EvaluationSuite : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::path(testing::TempDir()) / "relign_suite_XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    catalog_.scan(RELIGN_PLUGIN_DIR);
    add_plugin("mine", R"("kind": "optimizer", "observes": ["merit"], "parameters": {
      "model": {"type": "file", "default": "", "description": "A file."},
      "inner": {"type": "algorithm", "default": "home", "description": "Inner."}})");
    write("mine/model.bin", "m");
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  void add_plugin(const std::string& id, const std::string& rest) const {
    write(id + "/relign-plugin.json", "{\"id\": \"" + id + R"(", "summary": "S.", )" + rest + "}");
    write(id + "/" + id + ".so", "not loaded");
  }
  Json entry(const Submission& submission) { return submitted_entry(submission, folder_, "submission", catalog_); }

  Submission mine() const {
    Submission submission;
    submission.name = "ours";
    submission.use = submission.plugin = "mine";
    submission.parameters = {{"model", "mine/model.bin"}, {"inner", {{"use", "mine"}}}};
    return submission;
  }
  fs::path folder_;
  plugin_host::Catalog catalog_;
};

TEST_F(EvaluationSuite, EntryNamesEveryPathBelowItsPlace) {
  EXPECT_EQ(entry(mine()), Json::parse(R"({"use": "submission/mine", "name": "ours", "parameters":
    {"model": "submission/mine/model.bin", "inner": {"use": "mine"}}})"));
  Submission shipped;
  shipped.name = "tuned";
  shipped.use = "nlopt-sbplx";
  shipped.parameters = Json::object();
  shipped.protocol = "blind";
  EXPECT_EQ(entry(shipped), Json::parse(R"({"use": "nlopt-sbplx", "name": "tuned", "protocol": "blind"})"));
}

TEST_F(EvaluationSuite, EntryIsTheAlgorithmOfTheManifest) {
  Submission other = mine();
  other.use = "home";
  EXPECT_THAT(refusal([&] { entry(other); }), HasSubstr("uses 'home', but the id of 'plugin' is 'mine'"));
  add_plugin("level", R"("kind": "noise-level")");
  other.use = other.plugin = "level";
  EXPECT_THAT(refusal([&] { entry(other); }), HasSubstr("'plugin' is a noise-level"));
}

TEST_F(EvaluationSuite, OwnPathsOfTheSuiteBecomeAbsolute) {
  write("suites/my/scene.json", R"({"use": "lens_system"})");
  const JsonSource suite = JsonSource::from_text(
      R"({"$schema": "x", "scenes": ["my/scene.json", "relign_od"], "noise_levels": ["rho0"], "algorithms":
         ["nlopt-sbplx", {"use": "imitation", "name": "own", "parameters": {"model": "my/net.onnx"}}]})",
      (folder_ / "suites/board.json").string());
  const Json made = Json::parse(evaluation_suite(suite, entry(mine()), catalog_));
  EXPECT_EQ(made["scenes"], Json({(folder_ / "suites/my/scene.json").string(), "relign_od"}));
  EXPECT_EQ(made["algorithms"][0], "nlopt-sbplx");
  EXPECT_EQ(made["algorithms"][1]["parameters"]["model"], (folder_ / "suites/my/net.onnx").string());
  EXPECT_EQ(made["algorithms"][2]["name"], "ours");
  EXPECT_EQ(made["name"], "board");
  EXPECT_FALSE(made.contains("$schema"));
}

TEST_F(EvaluationSuite, NamesAreUnique) {
  for (const char* taken : {R"("ours")", R"({"use": "ours"})", R"({"use": "random", "name": "ours"})"})
    EXPECT_THAT(refusal([&] {
                  evaluation_suite(JsonSource::from_text(std::string(R"({"algorithms": [)") + taken + "]}", "s.json"),
                                   entry(mine()), catalog_);
                }),
                HasSubstr("has an algorithm called 'ours' already"));
}

TEST_F(EvaluationSuite, FilesOutsideTheSubmissionAreRefused) {
  write("sub/inside.bin", "i");
  write("secret", "s");
  const auto choose = [&](const Json& parameters) {
    return catalog_.resolve_or_throw(plugin_host::Kind::optimizer, (folder_ / "mine").string(), parameters);
  };
  refuse_files_outside(choose({{"model", (folder_ / "mine/model.bin").string()}}), folder_ / "mine");
  EXPECT_THAT(refusal([&] {
                refuse_files_outside(choose({{"model", (folder_ / "secret").string()}}), folder_ / "mine");
              }),
              HasSubstr("secret', which is outside the submission"));
  // A default of the stranger's own plugin, and an algorithm that theirs runs.
  add_plugin("sly", R"("kind": "optimizer", "parameters": {
    "model": {"type": "file", "default": "../secret", "description": "A file."}})");
  const auto sly = catalog_.resolve_or_throw(plugin_host::Kind::optimizer, (folder_ / "sly").string());
  EXPECT_THAT(refusal([&] { refuse_files_outside(sly, folder_ / "sly"); }), HasSubstr("/secret', which is outside"));
  EXPECT_THAT(refusal([&] {
                refuse_files_outside(choose({{"inner", "sly"}}), folder_ / "mine");
              }),
              HasSubstr("which is outside"));
  EXPECT_THAT(refusal([&] { refuse_files_outside(choose(nullptr), folder_ / "sub"); }),
              HasSubstr("relign-plugin.json"));
}

}  // namespace
}  // namespace relign::submissions
