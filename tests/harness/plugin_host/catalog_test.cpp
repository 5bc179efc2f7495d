#include "plugin_host/catalog.h"

#include <gmock/gmock.h>

#include <cstdlib>

#include "plugin_host/objects.h"
#include "test_folder.h"

namespace relign::plugin_host {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class CatalogTest : public test::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    plugin("roots/compass", R"({"id": "compass", "kind": "optimizer", "summary": "s",
      "parameters": {"first_stride": {"type": "number", "default": 0.1, "minimum": 0.001, "maximum": 0.5},
                     "count": {"type": "integer", "default": 2}},
      "presets": {"compass-wide": {"parameters": {"first_stride": 0.3}}}})",
           "compass.so");
    plugin("roots/deep/policy", R"({"id": "policy", "kind": "agent", "summary": "s",
      "parameters": {"model": {"type": "file", "description": "the network"},
                     "notes": {"type": "file", "default": ""},
                     "then": {"type": "algorithm", "default": "compass"}}})",
           "policy.so");
    plugin("roots/lens", R"({"id": "lens_system", "kind": "scene", "summary": "s", "document": "scene",
      "parameters": {"scene": {"type": "file"}, "threads": {"type": "integer", "default": 1}},
      "presets": {"relign_od": {"parameters": {"scene": "relign_od/scene.json"}}}})",
           "lens_system.so");
    write("roots/lens/relign_od/scene.json", R"({"use": "lens_system", "n": 1})");
    plugin("roots/rho", R"({"id": "rho", "kind": "noise-level", "summary": "s",
      "presets": {"rho0.25": {}}})",
           "rho.so");
    catalog_.scan(folder_ / "roots");
    ASSERT_THAT(catalog_.refused(), IsEmpty());
  }

  Choice resolve(Kind kind, const std::string& name, const Json& given = {}) {
    problems_.clear();
    return catalog_.resolve(kind, name, given, folder_, problems_);
  }
  // The problems of a use that must fail, one per line.
  std::string problems(Kind kind, const std::string& name, const Json& given = {}) {
    const Choice choice = resolve(kind, name, given);
    EXPECT_FALSE(choice.plugin);
    EXPECT_FALSE(problems_.empty());
    std::string text;
    for (const Problem& problem : problems_) text += problem.to_string() + "\n";
    return text;
  }

  Catalog catalog_;
  std::vector<Problem> problems_;
};

TEST_F(CatalogTest, ListsByKindAndId) {
  std::vector<std::string> ids;
  for (const auto& plugin : catalog_.plugins()) ids.push_back(plugin->id);
  EXPECT_THAT(ids, ElementsAre("lens_system", "rho", "compass", "policy"));
  EXPECT_THAT(catalog_.ids(Kind::agent), ElementsAre("compass", "compass-wide", "policy"));
  EXPECT_THAT(catalog_.ids(Kind::noise_level), ElementsAre("rho", "rho0.25"));
}

TEST_F(CatalogTest, DefaultsThenPresetThenGiven) {
  EXPECT_EQ(resolve(Kind::optimizer, "compass").parameters, (Json{{"count", 2}, {"first_stride", 0.1}}));
  EXPECT_EQ(resolve(Kind::optimizer, "compass-wide").parameters, (Json{{"count", 2}, {"first_stride", 0.3}}));
  const Choice given = resolve(Kind::optimizer, "compass_wide", {{"first-stride", 0.2}, {"count", 5}});
  EXPECT_EQ(given.parameters, (Json{{"count", 5}, {"first_stride", 0.2}}));
  EXPECT_EQ(given.id, "compass-wide");
  EXPECT_EQ(given.plugin->id, "compass");
}

TEST_F(CatalogTest, OptimizersAndAgentsAreOneNamespace) {
  EXPECT_TRUE(resolve(Kind::agent, "compass").plugin);
  EXPECT_THAT(problems(Kind::scene, "compass"), HasSubstr("'compass' is an algorithm; expected a scene"));
  EXPECT_THAT(problems(Kind::optimizer, "rho0.25"), HasSubstr("a noise level; expected an algorithm"));
}

TEST_F(CatalogTest, ReportsAllMistakesWithTheNearestName) {
  EXPECT_THAT(problems(Kind::optimizer, "compas"), HasSubstr("unknown algorithm 'compas'; did you mean 'compass'?"));
  EXPECT_THAT(problems(Kind::noise_level, "xyzzy"), HasSubstr("unknown noise level 'xyzzy'; allowed: rho, rho0.25"));
  EXPECT_THAT(problems(Kind::optimizer, ""), HasSubstr("unknown algorithm ''"));
  EXPECT_THAT(problems(Kind::optimizer, "./none"), HasSubstr("none does not exist"));
  write("limits.json", "{}");
  EXPECT_THAT(problems(Kind::noise_level, "limit.json"),
              HasSubstr("limit.json does not exist; did you mean 'limits.json'?"));
  EXPECT_THAT(problems(Kind::noise_level, "rho0.3"), HasSubstr("unknown noise level 'rho0.3'"));
  write("triplet.ZMX", "VERS");
  EXPECT_THAT(problems(Kind::scene, "triplet.ZMX"),
              HasSubstr("is a lens file; create a scene with 'relign-bench scene new "));
  write("my_lens/scene.json", "{}");
  EXPECT_THAT(problems(Kind::scene, "./my_lens"), HasSubstr("; did you mean "));
  EXPECT_THAT(
      problems(Kind::optimizer, "compass", {{"first_strid", 1}, {"count", "two"}, {"first_stride", 7}}),
      AllOf(
          HasSubstr("/parameters/first_strid: 'compass' has no parameter 'first_strid'; did you mean 'first_stride'?"),
          HasSubstr("/parameters/count: count: expected an integer, found \"two\""),
          HasSubstr("/parameters/first_stride: first_stride: expected a number from 0.001 to 0.5, found 7")));
  EXPECT_THAT(problems(Kind::optimizer, "compass", {1, 2}), HasSubstr("/parameters: expected an object"));
  EXPECT_THAT(problems(Kind::optimizer, "compass", {{"first_stride", 0.1}, {"first-stride", 0.2}}),
              HasSubstr("duplicate parameter"));
  EXPECT_THAT(problems(Kind::noise_level, "rho", {{"a/b", 1}}),
              AllOf(HasSubstr("/parameters/a~1b"), HasSubstr("it has no parameters")));
  EXPECT_THAT(problems(Kind::agent, "policy"), HasSubstr("missing parameter 'model' (the network)"));
  EXPECT_THAT(problems(Kind::agent, "policy", {{"model", "none.onnx"}}), HasSubstr("none.onnx does not exist"));
  EXPECT_THAT(problems(Kind::agent, "policy", {{"model", "roots"}}), HasSubstr("is not a file"));
  write("m.onnx", "m");
  EXPECT_THAT(problems(Kind::agent, "policy", {{"model", "m.onnx"}, {"then", "compas"}}),
              HasSubstr("/parameters/then: unknown algorithm 'compas'"));
}

TEST_F(CatalogTest, ResolvesAlgorithmParameters) {
  write("m.onnx", "m");
  const Choice plain = resolve(Kind::agent, "policy", {{"model", "m.onnx"}});
  ASSERT_EQ(plain.algorithms.count("then"), 1u);
  EXPECT_EQ(plain.algorithms.at("then")->id, "compass");
  EXPECT_EQ(plain.algorithms.at("then")->parameters, (Json{{"count", 2}, {"first_stride", 0.1}}));
  const Json wide = {{"use", "compass_wide"}, {"parameters", {{"count", 3}}}};
  const Choice changed = resolve(Kind::agent, "policy", {{"model", "m.onnx"}, {"then", wide}});
  EXPECT_EQ(changed.algorithms.at("then")->parameters, (Json{{"count", 3}, {"first_stride", 0.3}}));
  EXPECT_NE(plain.identity, changed.identity) << "another inner algorithm means another trial";

  const Choice later = with_changes(*changed.algorithms.at("then"), {{"first-stride", 0.2}});
  EXPECT_EQ(later.parameters, (Json{{"count", 3}, {"first_stride", 0.2}}));
  EXPECT_THROW(with_changes(later, {{"first_stride", 9}}), Error);
  EXPECT_THROW(with_changes(later, {{"stride", 0.1}}), Error);
  EXPECT_THROW(with_changes(changed, {{"then", "compass"}}), Error);
}

TEST_F(CatalogTest, ReportsMistakesInInnerAlgorithms) {
  write("m.onnx", "m");
  const auto then = [&](const Json& value) {
    return problems(Kind::agent, "policy", {{"model", "m.onnx"}, {"then", value}});
  };
  EXPECT_THAT(then({{"use", "compas"}}), HasSubstr("/parameters/then: unknown algorithm 'compas'"));
  EXPECT_THAT(then({{"use", "compass"}, {"parameters", {{"count", "two"}}}}),
              HasSubstr("/parameters/then/parameters/count: "));
  EXPECT_THAT(then({{"uses", "compass"}}), HasSubstr("expected an algorithm's id"));
  EXPECT_THAT(then({{"use", "compass"}, {"stride", 1}}), HasSubstr("expected an algorithm's id"));
  EXPECT_THAT(then("rho"), HasSubstr("noise level"));
  plugin("roots/loop", R"({"id": "loop", "kind": "optimizer", "summary": "s",
    "parameters": {"then": {"type": "algorithm", "default": "loop"}}})",
         "loop.so");
  catalog_.add(folder_ / "roots" / "loop");
  EXPECT_THAT(problems(Kind::optimizer, "loop"), HasSubstr("nested deeper than 4"));
}

TEST_F(CatalogTest, MakesFilesAbsoluteAndIdentifiesThemByContent) {
  write("a/m.onnx", "weights");
  write("b/other.onnx", "weights");
  write("c/m.onnx", "other weights");
  const Choice a = resolve(Kind::agent, "policy", {{"model", "a/m.onnx"}});
  const Choice b = resolve(Kind::agent, "policy", {{"model", (folder_ / "b/other.onnx").string()}});
  const Choice c = resolve(Kind::agent, "policy", {{"model", "c/m.onnx"}});
  EXPECT_EQ(a.parameters.at("model"), (folder_ / "a/m.onnx").string());
  EXPECT_EQ(a.parameters.at("notes"), "");
  EXPECT_EQ(a.identity, b.identity);
  EXPECT_NE(a.identity, c.identity);
  EXPECT_EQ(a.identity.find(folder_.string()), std::string::npos);
  // printf weights | sha256sum
  EXPECT_THAT(a.identity,
              HasSubstr("\"model\":\"sha256:9a129038d9a00aed0cf6a7ea059ca50a813449061ab87848cf1a13eafdf33b2c\""));
}

TEST_F(CatalogTest, RecordsFilesByNameAndContent) {
  write("a/m.onnx", "weights");
  write("b/m.onnx", "weights");
  write("c/m.onnx", "other weights");
  const auto recorded = [&](const char* model) {
    return recorded_parameters(resolve(Kind::agent, "policy", {{"model", model}}));
  };
  EXPECT_EQ(recorded("a/m.onnx"), (Json{{"model", "m.onnx (sha256:9a129038d9a00aed)"}, {"then", "compass"}}))
      << "without the optional file that was not given";
  EXPECT_EQ(recorded("a/m.onnx"), recorded("b/m.onnx")) << "in any folder";
  EXPECT_NE(recorded("a/m.onnx"), recorded("c/m.onnx"));
  EXPECT_THAT(recorded_parameters(resolve(Kind::scene, "relign_od")).at("scene").get<std::string>(),
              testing::StartsWith("relign_od/scene.json (sha256:"))
      << "inside the plugin's folder";
}

TEST_F(CatalogTest, IdsDoNotChangeWithParametersAddedLater) {
  const char* const before =
      R"({"id": "grown", "kind": "optimizer", "summary": "s", "parameters": {"step": {"type": "number", "default": 1}}})";
  const char* const after =
      R"({"id": "grown", "kind": "optimizer", "summary": "s", "parameters": {"step": {"type": "number", "default": 1},
    "gentle": {"type": "number", "default": 0, "added_later": true}}})";
  plugin("before/grown", before, "grown.so");
  plugin("after/grown", after, "grown.so");
  const Choice old = resolve(Kind::optimizer, "before/grown");
  catalog_ = Catalog();
  const Choice grown = resolve(Kind::optimizer, "after/grown");
  EXPECT_EQ(old.identity, grown.identity);
  EXPECT_EQ(recorded_parameters(old), recorded_parameters(grown));
  EXPECT_EQ(grown.parameters, (Json{{"step", 1}, {"gentle", 0}})) << "the plugin is told";
  const Choice same = resolve(Kind::optimizer, "after/grown", {{"gentle", 0.0}}),
               other = resolve(Kind::optimizer, "after/grown", {{"gentle", 2}});
  EXPECT_EQ(old.identity, same.identity);
  EXPECT_NE(old.identity, other.identity);
  EXPECT_EQ(recorded_parameters(other), (Json{{"step", 1}, {"gentle", 2}}));
}

TEST_F(CatalogTest, GivesEqualValuesEqualIdentities) {
  const std::string one = resolve(Kind::optimizer, "compass", {{"first_stride", 0.3}}).identity;
  EXPECT_EQ(one, resolve(Kind::optimizer, "compass-wide").identity);
  EXPECT_EQ(resolve(Kind::optimizer, "compass").identity, resolve(Kind::optimizer, "compass", {{"count", 2}}).identity);
  EXPECT_NE(one, resolve(Kind::optimizer, "compass").identity);
  EXPECT_NE(one, resolve(Kind::optimizer, "compass-wide", {{"count", 3}}).identity);
}

TEST_F(CatalogTest, ResolvesPathsToPlugins) {
  const auto folder = plugin("elsewhere/probe", R"({"id": "probe", "kind": "optimizer", "summary": "s"})", "probe.so");
  EXPECT_EQ(resolve(Kind::optimizer, "elsewhere/probe").id, "probe");
  EXPECT_EQ(resolve(Kind::optimizer, "./elsewhere/probe/").id, "probe");  // the same plugin again
  EXPECT_EQ(resolve(Kind::optimizer, (folder / "probe.so").string()).id, "probe");
  EXPECT_EQ(resolve(Kind::optimizer, (folder / "relign-plugin.json").string()).id, "probe");
  EXPECT_EQ(resolve(Kind::optimizer, "probe").id, "probe");  // by its id, once added
  EXPECT_THAT(problems(Kind::scene, "elsewhere/probe"), HasSubstr("of the kind optimizer; expected a scene"));
  write("elsewhere/probe/second.so", "x");
  Catalog fresh;
  EXPECT_THAT(test::error_text(ErrorKind::plugin_rejected, [&] { fresh.add(folder / "second.so"); }),
              HasSubstr("is not the library named in"));
  write("loose.so", "x");
  EXPECT_THAT(problems(Kind::optimizer, "./loose.so"), HasSubstr("there is no relign-plugin.json beside it"));
  EXPECT_THAT(problems(Kind::optimizer, "loose.so"), HasSubstr("there is no relign-plugin.json beside it"));
  write("some.txt", "x");
  EXPECT_THAT(problems(Kind::optimizer, "./some.txt"), HasSubstr("expected a plugin's folder"));
  EXPECT_THAT(problems(Kind::optimizer, "./roots"), HasSubstr("has no relign-plugin.json"));
}

TEST_F(CatalogTest, RequiresAVersion) {
  EXPECT_EQ(resolve(Kind::scene, "relign_od@1").identity, resolve(Kind::scene, "relign_od").identity);
  EXPECT_THAT(problems(Kind::scene, "relign-od@2"),
              HasSubstr("'relign_od@2' is not available: 'relign_od' has version 1 here"));
  EXPECT_THAT(problems(Kind::scene, "relign_od@"), HasSubstr("expected a whole number after '@'"));
  EXPECT_THAT(problems(Kind::scene, "relign_od@1.0"), HasSubstr("'relign_od@1.0' has no version"));
  write("versioned.json", R"({"use": "lens_system@1"})");
  EXPECT_THAT(problems(Kind::scene, "versioned.json"), HasSubstr("expected an id without a version"));
  EXPECT_THAT(problems(Kind::scene, "relign_of@1"), HasSubstr("did you mean 'relign_od'?"));

  plugin("drawn", R"({"id": "drawn", "kind": "noise-level", "summary": "s", "version": 2,
    "parameters": {"n": {"type": "integer", "default": 1}}, "presets": {"late": {"version": 3}, "early": {}}})",
         "drawn.so");
  catalog_.add(folder_ / "drawn");
  const Choice early = resolve(Kind::noise_level, "early@2"), late = resolve(Kind::noise_level, "late@3");
  EXPECT_EQ(early.identity, R"({"kind":"noise-level","parameters":{"n":1},"plugin":"drawn","version":2})");
  EXPECT_NE(late.identity, early.identity);
  EXPECT_EQ(with_changes(early, {{"n", 1}}).identity, early.identity);
  EXPECT_THAT(problems(Kind::noise_level, "late@2"), HasSubstr("'late' has version 3 here"));
}

TEST_F(CatalogTest, ResolvesDocumentsToTheirPlugin) {
  write("my/lens.json", R"({"use": "lens-system", "anything": [1, 2]})");
  const Choice document = resolve(Kind::scene, "my/lens.json", {{"threads", 4}});
  ASSERT_TRUE(document.plugin);
  EXPECT_EQ(document.id, "lens");
  EXPECT_EQ(document.parameters, (Json{{"scene", (folder_ / "my/lens.json").string()}, {"threads", 4}}));
  // A preset's file is relative to the manifest.
  EXPECT_EQ(resolve(Kind::scene, "relign_od").parameters.at("scene"),
            (folder_ / "roots/lens/relign_od/scene.json").string());

  EXPECT_THAT(problems(Kind::scene, "my/lens.json", {{"scene", "x"}}),
              HasSubstr("the parameter 'scene' cannot be given"));
  write("my/wrong.json", "{\n \"use\": \"lens-sytem\"}");
  EXPECT_THAT(problems(Kind::scene, "my/wrong.json"),
              AllOf(HasSubstr("wrong.json:2:9: /use"), HasSubstr("did you mean 'lens_system'?")));
  write("my/level.json", R"({"use": "rho"})");
  EXPECT_THAT(problems(Kind::noise_level, "my/level.json"), HasSubstr("'rho' does not take documents"));
  write("my/nested.json", R"({"use": "./lens.json"})");
  EXPECT_THAT(problems(Kind::scene, "my/nested.json"), HasSubstr("cannot use another document"));
  write("my/number.json", R"({"use": 3})");
  EXPECT_THAT(problems(Kind::scene, "my/number.json"), HasSubstr("expected the id of a scene"));
  write("my/preset.json", R"({"use": "relign_od"})");
  EXPECT_THAT(problems(Kind::scene, "my/preset.json"),
              AllOf(HasSubstr("preset.json:1:9: /use: 'relign_od' is a preset with a document of its own"),
                    HasSubstr("use 'lens_system'")));
  write("my/none.json", "{}");
  EXPECT_THAT(problems(Kind::scene, "my/none.json"), HasSubstr("neither a plugin's manifest nor a document"));
  write("my/broken.json", "{");
  EXPECT_THAT(problems(Kind::scene, "my/broken.json"), HasSubstr("invalid JSON"));
}

TEST_F(CatalogTest, RejectsDuplicates) {
  const auto refused = [&](const char* folder, const std::string& manifest) {
    const auto path = plugin(folder, manifest, "x.so");
    return test::error_text(ErrorKind::plugin_rejected, [&] { catalog_.add(path); });
  };
  EXPECT_THAT(refused("d1", R"({"id": "compass", "kind": "agent", "summary": "s", "library": "x.so"})"),
              AllOf(HasSubstr("'compass' already exists in"), HasSubstr("roots/compass")));
  EXPECT_THAT(refused("d2", R"({"id": "compass_wide", "kind": "optimizer", "summary": "s", "library": "x.so"})"),
              HasSubstr("'compass_wide' already exists"));
  EXPECT_THAT(refused("d3", R"({"id": "new", "kind": "optimizer", "summary": "s", "library": "x.so",
                               "presets": {"policy": {}}})"),
              HasSubstr("'policy' already exists"));
  // Another namespace may have the name.
  plugin("d4", R"({"id": "compass", "kind": "scene", "summary": "s"})", "compass.so");
  catalog_.add(folder_ / "d4");
  EXPECT_TRUE(resolve(Kind::scene, "compass").plugin);
}

TEST_F(CatalogTest, ScanContinuesAfterABadPlugin) {
  write("more/bad/relign-plugin.json", "{");
  plugin("more/good", R"({"id": "good", "kind": "scene", "summary": "s"})", "good.so");
  write("more/lost/relign-plugin.json", R"({"id": "lost", "kind": "scene", "summary": "s"})");
  fs::create_directory_symlink(folder_ / "more", folder_ / "more/loop");
  catalog_.scan(folder_ / "more");
  catalog_.scan(folder_ / "not there");
  EXPECT_TRUE(resolve(Kind::scene, "good").plugin);
  ASSERT_EQ(catalog_.refused().size(), 3u);
  EXPECT_THAT(catalog_.refused()[0], HasSubstr("bad/relign-plugin.json:1:"));
  EXPECT_THAT(catalog_.refused()[1], HasSubstr("lost.so does not exist; build the plugin"));
  EXPECT_THAT(catalog_.refused()[2], HasSubstr("is not a folder"));
  EXPECT_THAT(problems(Kind::scene, "lost"), HasSubstr("\n  refused:"));
}

TEST_F(CatalogTest, ResolveOrThrowKeepsTheKindOfError) {
  EXPECT_THAT(test::error_text(ErrorKind::bad_input, [&] { catalog_.resolve_or_throw(Kind::scene, "nothing"); }),
              HasSubstr("unknown scene 'nothing'"));
  EXPECT_THAT(test::error_text(ErrorKind::bad_input,
                               [&] {
                                 catalog_.resolve_or_throw(Kind::optimizer, "compass", {{"count", -0.5}});
                               }),
              HasSubstr("/parameters/count"));
  write("bad/relign-plugin.json", "{");
  test::error_text(ErrorKind::plugin_rejected,
                   [&] { catalog_.resolve_or_throw(Kind::optimizer, (folder_ / "bad").string()); });
}

TEST_F(CatalogTest, ReadsRootsFromTheEnvironment) {
  ::setenv("RELIGN_PLUGIN_PATH", "/one::/two", 1);
  const std::vector<fs::path> roots = Catalog::default_roots();
  ::unsetenv("RELIGN_PLUGIN_PATH");
  ASSERT_GE(roots.size(), 2u);
  EXPECT_EQ(roots[roots.size() - 2], "/one");
  EXPECT_EQ(roots.back(), "/two");
  EXPECT_EQ(roots.size(), Catalog::default_roots().size() + 2);
}

TEST_F(CatalogTest, HashChangesWithLibraryAndManifest) {
  const std::string before = plugin_hash(*resolve(Kind::optimizer, "compass").plugin);
  EXPECT_EQ(before.size(), 64u);
  EXPECT_EQ(before, plugin_hash(*resolve(Kind::optimizer, "compass-wide").plugin));
  write("roots/compass/compass.so", "built again");
  const std::string rebuilt = plugin_hash(*resolve(Kind::optimizer, "compass").plugin);
  EXPECT_NE(before, rebuilt);
  Manifest other = *resolve(Kind::optimizer, "compass").plugin;
  other.text += " ";
  EXPECT_NE(rebuilt, plugin_hash(other));
}

}  // namespace
}  // namespace relign::plugin_host
