#include "plugin_host/manifest.h"

#include <gmock/gmock.h>
#include <relign/plugin.h>

#include "plugin_host/training.h"
#include "test_folder.h"

namespace relign::plugin_host {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class ManifestTest : public test::FolderTest {
 protected:
  std::string refusal(const std::string& manifest) {
    const auto file = write("relign-plugin.json", manifest);
    return test::error_text(ErrorKind::plugin_rejected, [&] { read_manifest(file); });
  }
  // A valid optimizer with one more member.
  std::string refusal_with(const std::string& member) {
    return refusal("{\"id\": \"a\", \"kind\": \"optimizer\", \"summary\": \"One.\",\n " + member + "}");
  }
};

const char* const kFull = R"({
  "$schema": "ignored", "id": "full", "kind": "agent", "summary": "All of it.", "observes": ["images", "start"],
  "oracle": true, "reproducible": "this_cpu", "license": "MIT", "citation": "somebody", "library": "other.so",
  "document": "model",
  "parameters": {
    "first_stride": {"type": "number", "default": 0.1, "minimum": 0.001, "maximum": 0.5, "unit": "share", "description": "d"},
    "count": {"type": "integer", "default": 3},
    "eager": {"type": "boolean", "default": false},
    "mode": {"type": "text", "default": "fast", "allowed": ["fast", "slow"]},
    "model": {"type": "file"},
    "inner": {"type": "algorithm", "default": "compass"},
    "extra": {"type": "json", "default": {"a": [1]}}
  },
  "presets": {"full-slow": {"summary": "s", "parameters": {"mode": "slow", "first-stride": 0.2}}}
})";

TEST_F(ManifestTest, ReadsEverything) {
  const Manifest manifest = read_manifest(write("relign-plugin.json", kFull));
  EXPECT_EQ(manifest.id, "full");
  EXPECT_EQ(manifest.kind, Kind::agent);
  EXPECT_EQ(manifest.observed_bits(), std::uint32_t{RELIGN_OBSERVES_IMAGES | RELIGN_OBSERVES_START});
  EXPECT_TRUE(manifest.oracle);
  EXPECT_EQ(manifest.reproducible, "this_cpu");
  EXPECT_EQ(manifest.library, folder_ / "other.so");
  EXPECT_EQ(manifest.folder, folder_);
  EXPECT_EQ(manifest.text, kFull);
  EXPECT_EQ(manifest.document, "model");
  ASSERT_EQ(manifest.parameters.size(), 7u);
  const Parameter* stride = manifest.parameter("first-stride");  // `-` equals `_`
  ASSERT_TRUE(stride);
  EXPECT_EQ(stride->name, "first_stride");
  EXPECT_EQ(stride->maximum, 0.5);
  EXPECT_EQ(stride->unit, "share");
  EXPECT_TRUE(manifest.parameter("model")->default_value.is_null());
  EXPECT_THAT(manifest.parameter("mode")->allowed, ElementsAre("fast", "slow"));
  ASSERT_TRUE(manifest.preset("full_slow"));
  EXPECT_EQ(manifest.preset("full_slow")->parameters, (Json{{"mode", "slow"}, {"first_stride", 0.2}}));
}

TEST_F(ManifestTest, UsesDefaultsOfAMinimalManifest) {
  const Manifest manifest =
      read_manifest(write("relign-plugin.json", R"({"id": "b", "kind": "noise_level", "summary": "One."})"));
  EXPECT_EQ(manifest.kind, Kind::noise_level);
  EXPECT_EQ(manifest.library, folder_ / "b.so");
  EXPECT_EQ(manifest.reproducible, "anywhere");
  EXPECT_FALSE(manifest.oracle);
  EXPECT_EQ(manifest.parameter("x"), nullptr);
}

TEST_F(ManifestTest, ReportsEveryMistakeWithItsPosition) {
  const std::string text = refusal(R"({
  "id": "bad id", "kind": "optimiser", "observes": ["image"],
  "parameters": {"x": {"type": "number", "default": "much"}},
  "preset": {}
})");
  EXPECT_THAT(text, HasSubstr("relign-plugin.json:2:9: /id: expected 1 to 64 letters"));
  EXPECT_THAT(text, HasSubstr("/kind: unknown kind 'optimiser'; did you mean 'optimizer'?"));
  EXPECT_THAT(text, HasSubstr("missing key 'summary'"));
  EXPECT_THAT(text, HasSubstr("/observes: unknown entry 'image'; did you mean 'images'?"));
  EXPECT_THAT(text, HasSubstr("3:53: /parameters/x/default: expected a number, found \"much\""));
  EXPECT_THAT(text, HasSubstr("unknown key 'preset'; did you mean 'presets'?"));
}

TEST_F(ManifestTest, RejectsInvalidValues) {
  EXPECT_THAT(refusal("[1]"), HasSubstr("expected an object"));
  EXPECT_THAT(refusal("{"), HasSubstr("invalid JSON"));
  EXPECT_THAT(test::error_text(ErrorKind::plugin_rejected, [&] { read_manifest(folder_ / "none.json"); }),
              HasSubstr("none.json"));
  EXPECT_THAT(refusal_with(R"("reproducible": "maybe")"), HasSubstr("this_cpu"));
  EXPECT_THAT(refusal_with(R"("oracle": true)"), HasSubstr("add \"start\" to \"observes\""));
  const auto scene_with = [this](const std::string& model_parameters) {
    return refusal(R"({"id": "a", "kind": "scene", "summary": "One.", "model_parameters": )" + model_parameters + R"(,
      "parameters": {"light": {"type": "text", "allowed": ["ghost", "plain"]}, "n": {"type": "integer"}}})");
  };
  EXPECT_THAT(scene_with(R"({"lihgt": "plain"})"), HasSubstr("unknown parameter 'lihgt'; did you mean 'light'?"));
  EXPECT_THAT(scene_with(R"({"light": "plane"})"), HasSubstr("expected one of ghost, plain, found \"plane\""));
  EXPECT_THAT(scene_with(R"({"light": {"goast": "plain"}})"), HasSubstr("expected one of ghost, plain"));
  EXPECT_THAT(scene_with(R"({"n": {"1": 2}})"), HasSubstr("/model_parameters/n: expected an integer"));
  EXPECT_THAT(scene_with("[]"), HasSubstr("expected an object"));
  EXPECT_THAT(refusal_with(R"("model_parameters": {})"), HasSubstr("only scenes have a design model"));
  EXPECT_THAT(refusal_with(R"("document": "scene")"), HasSubstr("parameter of type file"));
  EXPECT_THAT(refusal_with(R"("library": "")"), HasSubstr("/library"));
  for (const char* outside : {"../other/other.so", "/usr/lib/other.so", "deep/../../other.so", ".."})
    EXPECT_THAT(refusal_with("\"library\": \"" + std::string(outside) + "\""),
                AllOf(HasSubstr("/library"), HasSubstr("outside the plugin's folder")))
        << outside;
  std::filesystem::create_symlink("/bin/true", folder_ / "link.so");
  EXPECT_THAT(refusal_with(R"("library": "link.so")"), HasSubstr("outside the plugin's folder"));
  EXPECT_THAT(refusal_with(R"("command": ["python3", "/etc/passwd"])"), HasSubstr("outside the plugin's folder"));
  EXPECT_THAT(refusal(R"({"id": "a", "kind": "scene", "summary": "One.", "observes": ["box"]})"),
              HasSubstr("only optimizers and agents"));
  EXPECT_THAT(refusal_with(R"("parameters": [])"), HasSubstr("expected an object"));
  EXPECT_THAT(refusal_with(R"("parameters": {"x": 1})"), HasSubstr("expected an object with 'type'"));
  EXPECT_THAT(refusal_with(R"("parameters": {"x": {"type": "float"}})"), HasSubstr("known: number, integer"));
  EXPECT_THAT(refusal_with(R"("parameters": {"x": {"default": 1}})"), HasSubstr("missing key 'type'"));
  EXPECT_THAT(refusal_with(R"("parameters": {"x": {"type": "number", "minimum": 2, "maximum": 1}})"),
              HasSubstr("must not be larger than 'maximum'"));
  EXPECT_THAT(refusal_with(R"("parameters": {"x": {"type": "number", "default": 3, "maximum": 1}})"),
              HasSubstr("at most 1, found 3"));
  EXPECT_THAT(refusal_with(R"("parameters": {"x": {"type": "text", "minimum": 2}})"), HasSubstr("has a range"));
  EXPECT_THAT(refusal_with(R"("parameters": {"x": {"type": "number", "allowed": ["1"]}})"),
              HasSubstr("only a parameter of type text"));
  EXPECT_THAT(refusal_with(R"("parameters": {"x": {"type": "text", "allowed": ["a", "a"]}})"), HasSubstr("duplicate"));
  EXPECT_THAT(refusal_with(R"("parameters": {"a_b": {"type": "text"}, "a-b": {"type": "text"}})"),
              HasSubstr("duplicate parameter name"));
  EXPECT_THAT(refusal_with(R"("presets": {"A": {"parameters": {"x": 1}}})"), HasSubstr("unknown parameter 'x'"));
  EXPECT_THAT(refusal_with(R"("presets": {"a": {}})"), HasSubstr("already has this name"));
  EXPECT_THAT(refusal_with(R"("presets": {"b": {"parameter": {}}})"), HasSubstr("unknown key 'parameter'"));
  EXPECT_THAT(refusal_with(R"("parameters": {"x": {"type": "integer"}}, "presets": {"b": {"parameters": {"x": 1.5}}})"),
              HasSubstr("/presets/b/parameters/x: expected an integer, found 1.5"));
}

TEST(CheckParameter, NamesTheMistake) {
  Parameter number{"x", ParameterType::number, {}, 0.5, 2, {}, "mm", ""};
  EXPECT_EQ(check_parameter(number, 1), "");
  EXPECT_EQ(check_parameter(number, 0.5), "");
  EXPECT_EQ(check_parameter(number, 3), "expected a number from 0.5 to 2 (mm), found 3");
  EXPECT_EQ(check_parameter(number, true), "expected a number from 0.5 to 2 (mm), found true");
  EXPECT_NE(check_parameter(number, std::numeric_limits<double>::quiet_NaN()), "");
  Parameter integer{"x", ParameterType::integer, {}, 0, {}, {}, "", ""};
  EXPECT_EQ(check_parameter(integer, 7), "");
  EXPECT_EQ(check_parameter(integer, -1), "expected an integer of at least 0, found -1");
  EXPECT_NE(check_parameter(integer, 1.5), "");
  EXPECT_NE(check_parameter(integer, std::uint64_t{1} << 63), "");
  Parameter text{"x", ParameterType::text, {}, {}, {}, {"fast", "slow"}, "", ""};
  EXPECT_EQ(check_parameter(text, "fast"), "");
  EXPECT_THAT(check_parameter(text, "fats"), AllOf(HasSubstr("one of fast, slow"), HasSubstr("did you mean 'fast'?")));
  Parameter file{"x", ParameterType::file, {}, {}, {}, {}, "", ""};
  EXPECT_EQ(check_parameter(file, "a.json"), "");
  EXPECT_NE(check_parameter(file, ""), "");
  file.default_value = "";
  EXPECT_EQ(check_parameter(file, ""), "");  // optional
  Parameter boolean{"x", ParameterType::boolean, {}, {}, {}, {}, "", ""};
  EXPECT_EQ(check_parameter(boolean, false), "");
  EXPECT_EQ(check_parameter(boolean, 0), "expected true or false, found 0");
}

TEST(Kinds, NamesRoundTrip) {
  for (const Kind kind : {Kind::scene, Kind::noise_level, Kind::optimizer, Kind::agent})
    EXPECT_EQ(kind_from_name(kind_name(kind)), kind);
  EXPECT_EQ(kind_from_name("noise_level"), Kind::noise_level);
  EXPECT_EQ(kind_from_name("level"), std::nullopt);
}

TEST_F(ManifestTest, ReadsPretrainingFromNumbersOrParameters) {
  const std::string parameters =
      R"("parameters": {"much": {"type": "integer", "default": 7, "minimum": 1, "maximum": 20},
                        "any": {"type": "integer", "default": 7}})";
  const auto read = [&](const std::string& prepare) {
    return read_manifest(write(
        "relign-plugin.json",
        R"({"id": "a", "kind": "optimizer", "summary": "One.", "prepare": )" + prepare + ", " + parameters + "}"));
  };
  const Manifest named = read(R"({"sources": 10, "steps": "much"})");
  EXPECT_EQ(pretraining(named, {{"much", 5}, {"any", 1}})->sources, 10U);
  EXPECT_EQ(pretraining(named, {{"much", 5}, {"any", 1}})->steps, 5U);
  EXPECT_FALSE(pretraining(read_manifest(write("relign-plugin.json", kFull)), {}));
  const auto refused = [&](const std::string& prepare) { return refusal_with("\"prepare\": " + prepare); };
  EXPECT_THAT(refused(R"({"sources": 0, "steps": 1})"), HasSubstr("sources"));
  EXPECT_THAT(refused(R"({"sources": 1})"), HasSubstr("missing key 'steps'"));
  EXPECT_THAT(refused(R"({"sources": 1, "steps": "much"})"), HasSubstr("the name of an integer parameter"));
  EXPECT_THAT(refused(R"({"sources": 1, "steps": 1, "step": 1})"), HasSubstr("step"));
  EXPECT_THAT(refused("7"), HasSubstr("expected an object"));
  EXPECT_EQ(
      pretraining(read(R"({"sources": 3, "steps": 1}, "command": ["python3", "a.py"])"), {{"much", 7}, {"any", 7}})
          ->sources,
      3U)
      << "processes have pretraining, too";
  EXPECT_THAT(refusal(R"({"id": "a", "kind": "scene", "summary": "One.", "prepare": {"sources": 1, "steps": 1}})"),
              HasSubstr("only optimizers and agents have pretraining"));
  EXPECT_THAT(test::error_text(ErrorKind::plugin_rejected, [&] { read(R"({"sources": "any", "steps": 1})"); }),
              HasSubstr("with a minimum and a maximum"));
}

}  // namespace
}  // namespace relign::plugin_host
