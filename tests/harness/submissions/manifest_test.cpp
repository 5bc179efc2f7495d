#include <gmock/gmock.h>

#include <fstream>

#include "refusal.h"
#include "submissions/environment_lock.h"
#include "submissions/submission.h"

namespace relign::submissions {
namespace {

using testing::AllOf;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;

const Json kWhole = Json::parse(R"({
  "name": "my_search", "version": "1.0-rc1+2", "summary": "Random local search.", "authors": ["A. Müller", "B"],
  "licence": "MIT", "citation": "A paper", "homepage": "https://example.org", "plugin": "build/my_search",
  "algorithm": {"use": "my_search", "parameters": {"model": "models/a.onnx"}, "protocol": "blind", "merit": "rmse"},
  "training": {"steps": 10, "images": 20, "hours": 1.5, "hardware": "one GPU"}, "environment": "requirements.lock",
  "self_test": {"scene": "relign_od", "noise_level": "rho0.25", "steps": 3}})");

Submission read(const Json& json) { return read_submission(JsonSource::from_text(json.dump(), "submission.json")); }

std::string mistake(const char* pointer, const Json& value) {
  Json json = kWhole;
  json[Json::json_pointer(pointer)] = value;
  return refusal([&] { read(json); });
}

TEST(SubmissionManifest, ReadsEveryKey) {
  const Submission found = read(kWhole);
  EXPECT_EQ(found.name, "my_search");
  EXPECT_EQ(found.version, "1.0-rc1+2");
  EXPECT_THAT(found.authors, ElementsAre("A. Müller", "B"));
  EXPECT_EQ(found.licence, "MIT");
  EXPECT_EQ(found.plugin, "build/my_search");
  EXPECT_EQ(found.parameters.at("model"), "models/a.onnx");
  EXPECT_EQ(found.protocol, "blind");
  EXPECT_EQ(found.training.at("hours"), 1.5);
  EXPECT_EQ(found.environment, "requirements.lock");
  EXPECT_EQ(found.self_test.scene, "relign_od");
  EXPECT_EQ(found.self_test.steps, 3U);
}

TEST(SubmissionManifest, ListsWhatIsMissing) {
  EXPECT_THAT(refusal([] { read(Json::object()); }),
              AllOf(HasSubstr("missing key 'name'"), HasSubstr("missing key 'version'"), HasSubstr("'summary'"),
                    HasSubstr("'authors'"), HasSubstr("'licence'"), HasSubstr("'algorithm'")));
  EXPECT_THAT(refusal([] { read(Json::array()); }), HasSubstr("expected an object"));
}

TEST(SubmissionManifest, RefusesPathsThatLeaveTheArchive) {
  for (const char* path : {"/etc", "../other", "a/../../b", "~/x", "", "a\nb"})
    EXPECT_THAT(mistake("/plugin", path), AnyOf(HasSubstr("/plugin: found"), HasSubstr("/plugin: expected a text")))
        << path;
  for (const char* path : {"/home/user/.ssh/id_rsa", "../../secret", "a/../../b"}) {
    EXPECT_THAT(mistake("/algorithm/parameters/model", path), HasSubstr("a path must be relative")) << path;
    EXPECT_THAT(mistake("/algorithm/parameters/inner", {{"use", path}}), HasSubstr("a path must be relative")) << path;
    EXPECT_THAT(mistake("/algorithm/use", path), HasSubstr("a path must be relative")) << path;
  }
}

TEST(SubmissionManifest, RefusesWhatAPageMustNotShow) {
  EXPECT_THAT(mistake("/homepage", "javascript:alert(1)"), HasSubstr("begins with https://"));
  EXPECT_THAT(mistake("/name", "../up"), HasSubstr("expected 1 to 64 letters"));
  EXPECT_THAT(mistake("/name", std::string(65, 'a')), HasSubstr("expected 1 to 64 letters"));
  EXPECT_THAT(mistake("/summary", "a\x1b[2J"), HasSubstr("control characters"));
  EXPECT_THAT(mistake("/summary", "two\nlines"), HasSubstr("line ends"));
  EXPECT_THAT(mistake("/summary", std::string(1001, 'a')), HasSubstr("expected a text of 1 to 1000 characters"));
  EXPECT_THAT(mistake("/authors", Json::array()), HasSubstr("/authors: expected a list of 1 to 100 texts"));
  EXPECT_THAT(mistake("/authors/0", 3), HasSubstr("/authors/0: expected a text of 1 to 1000 characters, found 3"));
}

TEST(SubmissionManifest, RefusesUnknownKeysAndRanges) {
  EXPECT_THAT(mistake("/licens", "MIT"), HasSubstr("unknown key 'licens'"));
  EXPECT_THAT(mistake("/training/gpus", 3), HasSubstr("unknown key 'gpus'"));
  EXPECT_THAT(mistake("/training/hours", -1), HasSubstr("/training/hours"));
  EXPECT_THAT(mistake("/self_test/steps", 101), HasSubstr("/self_test/steps"));
  EXPECT_THAT(mistake("/self_test/scene", "my/scene.json"), HasSubstr("installed scenes"));
}

TEST(EnvironmentLock, ReadsWhatPipFreezes) {
  const Packages packages = read_lock(
      "# made by pip freeze\nNumPy==1.26.4\n\nruamel.yaml==0.18 \\\n    --hash=sha256:abcd \\\n    --hash=sha256:ef\n"
      "colorama==0.4 ; sys_platform == 'win32'\nscipy==1.11.4  # solver\n",
      "requirements.lock");
  EXPECT_EQ(packages, (Packages{{"numpy", "1.26.4"}, {"ruamel-yaml", "0.18"}, {"scipy", "1.11.4"}}));
}

TEST(EnvironmentLock, RefusesWhatIsNoLock) {
  for (const char* line : {"numpy>=1.2", "numpy", "-r other.txt", "--index-url x", "git+https://x/y", "a==1,<2", "=="})
    EXPECT_THAT(refusal([&] { read_lock(std::string("a==1\n") + line + "\n", "lock"); }), HasSubstr("lock:2: found '"))
        << line;
}

TEST(EnvironmentLock, NamesWhatIsMissing) {
  EXPECT_EQ(missing_packages({{"a", "1"}, {"b", "2"}, {"c", "3"}}, {{"a", "1"}, {"b", "2.1"}}),
            "b 2 (found 2.1), c 3 (not installed)");
  EXPECT_EQ(missing_packages({}, {{"a", "1"}}), "");
}

}  // namespace
}  // namespace relign::submissions
