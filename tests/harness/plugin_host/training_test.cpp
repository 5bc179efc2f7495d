#include "plugin_host/training.h"

#include <gmock/gmock.h>

#include "test_folder.h"

namespace relign::plugin_host {
namespace {

using testing::HasSubstr;

class TrainingTest : public test::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    plugin("roots/policy", R"({"id": "policy", "kind": "agent", "summary": "s", "training": "model",
      "parameters": {"model": {"type": "file", "default": "own.onnx"}}})",
           "policy.so");
    write("roots/policy/own.onnx", "network");
    write("roots/policy/own.json", R"({"trained": {"hours": 1.5, "steps": 4000, "machine": "four cores",
      "warm_start": {"hours": 0.25}, "recipe": {}}})");
    plugin("roots/tuned", R"({"id": "tuned", "kind": "optimizer", "summary": "s",
      "training": {"hours": 2, "machine": "a cluster"}})",
           "tuned.so");
    plugin("roots/relay", R"({"id": "relay", "kind": "optimizer", "summary": "s", "parameters": {
      "first": {"type": "algorithm", "default": "policy"}, "then": {"type": "algorithm", "default": "plain"}}})",
           "relay.so");
    plugin("roots/plain", R"({"id": "plain", "kind": "optimizer", "summary": "s"})", "plain.so");
    catalog_.scan(folder_ / "roots");
    ASSERT_TRUE(catalog_.refused().empty()) << catalog_.refused().front();
  }
  Json of(const std::string& id, const Json& parameters = {}) {
    return training_of(catalog_.resolve_or_throw(Kind::optimizer, id, parameters));
  }
  Catalog catalog_;
};

TEST_F(TrainingTest, FindsTheFileBesideTheModel) {
  const auto side_file = [this](const std::string& id, const Json& parameters = {}) {
    return side_file_of(catalog_.resolve_or_throw(id == "policy" ? Kind::agent : Kind::optimizer, id, parameters));
  };
  write("mine.onnx", "network");
  const Json mine = {{"model", (folder_ / "mine.onnx").string()}};
  EXPECT_TRUE(side_file("policy", mine).is_null());
  write("mine.json", R"({"reproducible": "this_cpu"})");
  EXPECT_EQ(side_file("policy", mine), Json({{"reproducible", "this_cpu"}}));
  EXPECT_EQ(side_file("policy")["trained"]["steps"], 4000);
  EXPECT_TRUE(side_file("tuned").is_null());
}

TEST_F(TrainingTest, ReadsCostFromTheFileBesideTheModelWithWarmStart) {
  EXPECT_EQ(of("policy"), Json({{"hours", 1.75}, {"steps", 4000}, {"machine", "four cores"}}));
}

TEST_F(TrainingTest, ReadsCostOfTheUsersModel) {
  write("mine.onnx", "network");
  write("mine.json", R"({"trained": {"hours": 0.1, "steps": 7}})");
  const Json mine = {{"model", (folder_ / "mine.onnx").string()}};
  EXPECT_EQ(of("policy", mine), Json({{"hours", 0.1}, {"steps", 7}, {"machine", ""}}));
  // Trained at unknown cost, which differs from not trained.
  const Json unknown = {{"hours", nullptr}, {"steps", nullptr}, {"machine", ""}};
  for (const char* text : {"{", "[]", R"({"trained": {"hours": -1, "steps": "many"}})", "{}"}) {
    write("mine.json", text);
    EXPECT_EQ(of("policy", mine), unknown) << text;
  }
  std::filesystem::remove(folder_ / "mine.json");
  EXPECT_EQ(of("policy", mine), unknown);
}

TEST_F(TrainingTest, AddsStatedCostsOfInnerAlgorithms) {
  EXPECT_EQ(of("tuned"), Json({{"hours", 2}, {"steps", nullptr}, {"machine", "a cluster"}}));
  EXPECT_TRUE(of("plain").is_null());
  EXPECT_EQ(of("relay"), of("policy"));
  EXPECT_EQ(of("relay", {{"then", "tuned"}}),
            Json({{"hours", 3.75}, {"steps", nullptr}, {"machine", "four cores, a cluster"}}));
}

TEST_F(TrainingTest, RejectsMistakesInTheManifest) {
  const auto refusal = [&](const std::string& training, const std::string& kind = "agent") {
    write("bad/relign-plugin.json",
          R"({"id": "bad", "summary": "s", "parameters": {"count": {"type": "integer", "default": 1}}, "kind": ")" +
              kind + R"(", "training": )" + training + "}");
    try {
      read_manifest(folder_ / "bad/relign-plugin.json");
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_EQ(refusal(R"({"hours": 1, "steps": 3, "machine": "m"})"), "none");
  EXPECT_THAT(refusal(R"("model")"), HasSubstr("a parameter of type file, found 'model'"));
  EXPECT_THAT(refusal(R"("count")"), HasSubstr("a parameter of type file, found 'count'"));
  EXPECT_THAT(refusal("3"), HasSubstr("expected an object with 'hours'"));
  EXPECT_THAT(refusal(R"({"hours": -1})"), HasSubstr("/training/hours"));
  EXPECT_THAT(refusal(R"({"days": 1})"), HasSubstr("days"));
  EXPECT_THAT(refusal(R"({"hours": 1})", "scene"), HasSubstr("only optimizers and agents are trained"));
}

}  // namespace
}  // namespace relign::plugin_host
