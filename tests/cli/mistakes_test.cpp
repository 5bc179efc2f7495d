// Errors of users: a message on stderr, nothing on stdout, the documented exit code.
#include <gmock/gmock.h>

#include <fstream>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

const std::string kOutOfTree = fs::path(RELIGN_PLUGIN_DIR).parent_path().parent_path().parent_path() / "out_of_tree";

void expect_mistake(const Workplace& place, const std::vector<std::string>& arguments, int exit_code,
                    const testing::Matcher<std::string>& message) {
  const Outcome outcome = relign_bench(place, arguments);
  EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
  EXPECT_THAT(outcome.err, message);
  EXPECT_EQ(outcome.out, "");
}

TEST(CliMistakes, ReportsInvalidArguments) {
  const Workplace place;
  expect_mistake(place, {"rnu"}, 2, HasSubstr("unknown verb 'rnu'; did you mean 'run'?"));
  expect_mistake(place, {"run"}, 2, HasSubstr("SUITE is required"));
  expect_mistake(place, {"report", "a", "--format", "xml"}, 2,
                 HasSubstr("--format: found 'xml', expected one of html,md,csv,json"));
  expect_mistake(place, {"run", "a.json", "--workers", "two"}, 2, HasSubstr("--workers: found 'two', expected"));
  expect_mistake(place, {"run", "a.json", "-o"}, 2, HasSubstr("--out: missing value DIR"));
  expect_mistake(place, {"run", "--plan", "p.json"}, 2, HasSubstr("--plan also needs --shard"));
  expect_mistake(place, {"run", "a.json", "--wrokers", "2"}, 2, HasSubstr("did you mean '--workers'?"));
  expect_mistake(place, {"run", "a.json", "--workers", "0"}, 2, HasSubstr("--workers: found '0', expected 1 to 1024"));
  expect_mistake(place, {"run", "a.json", "--progress", "loud"}, 2, HasSubstr("--progress"));
  expect_mistake(place, {"run", "a.json", "--only", "color=red"}, 2, HasSubstr("unknown key 'color'"));
  expect_mistake(place, {"run", "a.json", "--only", "scene"}, 2, HasSubstr("key=value"));
  expect_mistake(place, {"try", "random", "--instance", "-3"}, 2, HasSubstr("'-3' must be a non-negative integer"));
  expect_mistake(place, {"try", "random", "--protocol", "papers"}, 2, HasSubstr("papers"));
  expect_mistake(place, {"list", "lenses"}, 2, HasSubstr("unknown kind 'lenses'"));
}

// A hint names the program as the user typed it; from the clone, relign-bench is not on the PATH.
TEST(CliMistakes, HintsCanBeTyped) {
  const Workplace place;
  const auto hint = [&](const std::string& script) {
    return shell(place, "ln -sfn \"$RELIGN_BENCH\" relign-bench; " + script).err;
  };
  EXPECT_THAT(hint("./relign-bench rnu"), HasSubstr("\nSee: ./relign-bench --help\n"));
  EXPECT_THAT(hint("./relign-bench lens drw"), HasSubstr("\nSee: ./relign-bench lens --help\n"));
  EXPECT_THAT(hint("PATH=\"$PWD:$PATH\"; relign-bench rnu"), HasSubstr("\nSee: relign-bench --help\n"));
  EXPECT_THAT(hint("mkdir -p 'my bin'; cp -P relign-bench 'my bin'; 'my bin/relign-bench' rnu"),
              HasSubstr("\nSee: 'my bin/relign-bench' --help\n"));
  EXPECT_THAT(hint("touch lens.zmx; ./relign-bench render --scene lens.zmx"),
              HasSubstr("'./relign-bench scene new lens.zmx'"));
  EXPECT_THAT(hint("./relign-bench report ."), HasSubstr("'./relign-bench run SUITE -o FOLDER'"));
  const std::string steps = hint("./relign-bench plugin new --kind optimizer mine");
  EXPECT_THAT(steps, HasSubstr("  cd mine\n")) << "so that a relative path would not lead to the program";
  EXPECT_THAT(steps, HasSubstr("  " + place.path("relign-bench").string() + " try ./build/mine\n"));
}

TEST(CliMistakes, ReportsUnknownPluginsPresetsAndParameters) {
  const Workplace place;
  expect_mistake(place, {"try", "nlopt-sblpx"}, 2, HasSubstr("did you mean 'nlopt-sbplx'?"));
  expect_mistake(place, {"try", "random", "--noise-level", "rho0.26"}, 2, HasSubstr("rho0.25"));
  const auto with_parameters = [](const char* text) {
    return std::vector<std::string>{"try", "nlopt-sbplx", "--parameters", text};
  };
  expect_mistake(place, with_parameters(R"({"first_strid": 0.2})"), 2, HasSubstr("did you mean 'first_stride'?"));
  expect_mistake(place, with_parameters(R"({"first_stride": 90})"), 2, HasSubstr("from 1e-04 to 0.5"));
  expect_mistake(place, with_parameters("[0.2]"), 2, HasSubstr("--parameters: expected a JSON object"));
  expect_mistake(place, with_parameters("{first_stride: 0.2}"), 2, HasSubstr("--parameters:1:"));
  const auto with_level = [](const char* text) {
    return std::vector<std::string>{"try", "random", "--noise-level", text};
  };
  expect_mistake(place, with_level(R"({"use": "rho", "parameters": {"lvel": 1}})"), 2,
                 HasSubstr("did you mean 'level'?"));
  expect_mistake(place, with_level(R"({"parameters": 3, "steps": 1})"), 2,
                 AllOf(HasSubstr("--noise-level:1:1: missing key 'use'"), HasSubstr("/parameters: expected an object"),
                       HasSubstr("unknown key 'steps'")));
  expect_mistake(place, with_level(R"({"use": "rho")"), 2, HasSubstr("--noise-level:1:14: invalid JSON"));
  expect_mistake(place,
                 {"try", R"({"use": "nlopt-sbplx", "parameters": {"first_stride": 0.2}})", "--parameters",
                  R"({"first_stride": 0.1})"},
                 2, HasSubstr("give them in one place"));
  expect_mistake(place, {"render", "--scene", "relign_do"}, 2, HasSubstr("did you mean 'relign_od'?"));
  expect_mistake(place, {"describe", "randon"}, 2, HasSubstr("did you mean 'random'?"));
  EXPECT_FALSE(fs::exists(place.path("render.png")));
}

TEST(CliMistakes, ListsEveryMistakeOfASuite) {
  const Workplace place;
  place.write("broken.json",
              "{\n"
              "  \"scenes\": [\"relign_od\"],\n"
              "  \"noise_levels\": [\"rho0.26\"],\n"
              "  \"algorithms\": [{\"use\": \"nlopt\", \"name\": \"wild\", \"parameters\": {\"first_stride\": 7}}],\n"
              "  \"instancse\": 10\n"
              "}\n");
  const auto all = AllOf(HasSubstr("broken.json:3:20: /noise_levels/0"), HasSubstr("did you mean 'rho0.25'?"),
                         HasSubstr("broken.json:4:"), HasSubstr("first_stride"), HasSubstr("0.5"),
                         HasSubstr("broken.json:5:"), HasSubstr("did you mean 'instances'?"));
  for (const char* verb : {"run", "validate"}) expect_mistake(place, {verb, "broken.json"}, 2, all);
  EXPECT_FALSE(fs::exists(place.path("results")));
}

TEST(CliMistakes, ReportsUnreadableSuites) {
  const Workplace place;
  place.write("half.json", "{\"scenes\": [\"relign_od\"],\n");
  expect_mistake(place, {"run", "half.json"}, 2, HasSubstr("half.json:"));
  expect_mistake(place, {"run", "nowhere.json"}, 2,
                 AllOf(HasSubstr("no file 'nowhere.json'; installed suites: "), HasSubstr(", quick")));
  expect_mistake(place, {"validate", "quik"}, 2, HasSubstr("did you mean the installed suite 'quick'?"));
  expect_mistake(place, {"plan", "suites/quick.json", "-o", "plan.json"}, 2,
                 HasSubstr("no file 'suites/quick.json'; did you mean the installed suite 'quick'?"));
  expect_mistake(place, {"validate", "."}, 2, HasSubstr("error: "));
}

TEST(CliMistakes, ResultsFolderDoesNotHideTheInstalledSuiteOfItsName) {
  const Workplace place;
  std::filesystem::create_directory(place.path("quick"));
  const Outcome planned = relign_bench(place, {"plan", "quick", "-o", "plan.json"});
  EXPECT_EQ(planned.exit_code, 0) << planned.err;
}

TEST(CliMistakes, ReportsUnreadableFiles) {
  const Workplace place;
  place.write("no_image.png", "not an image");
  place.write("no_lens.json", R"({"use": "lens_system", "prescription": 3})");
  place.write("lens.json", R"({"elements": {"L9": {"tilt_deg": [1]}}})");
  expect_mistake(place, {"render", "--target", "no_image.png"}, 2, HasSubstr("no_image.png"));
  expect_mistake(place, {"render", "--target", "missing.png"}, 2, HasSubstr("missing.png"));
  expect_mistake(place, {"render", "--scene", "./no_lens.json"}, 2, HasSubstr("no_lens.json"));
  expect_mistake(place, {"render", "--scene", "./missing.json"}, 2, HasSubstr("missing.json"));
  expect_mistake(place, {"render", "--assembly", "lens.json"}, 2,
                 AllOf(HasSubstr("lens.json:1:"), HasSubstr("unknown element 'L9'"), HasSubstr("tilt_deg")));
  EXPECT_FALSE(fs::exists(place.path("render.png")));
}

TEST(CliMistakes, ReportsInvalidRenderOptions) {
  const Workplace place;
  expect_mistake(place, {"render", "--pose", "0.5,0.5"}, 2, HasSubstr("5 needed: x,y,z,Rx,Ry"));
  expect_mistake(place, {"render", "--pose", "0.5,0.5,1.5,0.5,0.5"}, 2, HasSubstr("1.5 for z is outside 0 to 1"));
  expect_mistake(place, {"render", "--pose", "a,b"}, 2, HasSubstr("'a' is not a number"));
  expect_mistake(place, {"render", "--pose", "start"}, 2, HasSubstr("--noise-level"));
  expect_mistake(place, {"render", "-o", "image.bmp"}, 2, HasSubstr(".png, .npy or .tiff"));
  expect_mistake(place, {"render", "--sampler", "pupils"}, 2, HasSubstr("pupil"));
}

TEST(CliMistakes, ReportsUnwritableOutput) {
  const Workplace place;
  place.write("tiny.json", kTinySuite);
  place.write("file", "");
  expect_mistake(place, {"run", "tiny.json", "-o", "file", "--progress", "none"}, 2, HasSubstr("file"));
  expect_mistake(place, {"run", "tiny.json", "-o", "file/below", "--progress", "none"}, 2, HasSubstr("file"));
  expect_mistake(place, {"render", "-o", "file/image.png"}, 2, HasSubstr("file/image.png"));
  expect_mistake(place, {"report", "file"}, 2, HasSubstr("file"));
  const Outcome full = shell(place, "\"$RELIGN_BENCH\" list > /dev/full");
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_THAT(full.err, HasSubstr("No space left"));
}

TEST(CliMistakes, LeavesForeignFoldersUnchanged) {
  const Workplace place;
  place.write("tiny.json", kTinySuite);
  place.write("letters/manifest.json", "{\"to\": \"my aunt\"}");
  expect_mistake(place, {"run", "tiny.json", "-o", "letters", "--progress", "none"}, 2, HasSubstr("letters"));
  expect_mistake(place, {"report", "."}, 2, HasSubstr("results"));
  EXPECT_EQ(place.read("letters/manifest.json"), "{\"to\": \"my aunt\"}");
}

// A limit on file sizes simulates a full disk: writing fails in the middle of a file.
TEST(CliMistakes, DiscardsPartlyWrittenTrialsAfterFullDisk) {
  const Workplace place;
  place.write("tiny.json", kTinySuite);
  const Outcome full = shell(place, "trap '' XFSZ; ulimit -f 1; exec \"$RELIGN_BENCH\" run tiny.json --progress none");
  EXPECT_EQ(full.exit_code, 2) << full.err;
  EXPECT_THAT(full.err, HasSubstr("File too large"));
  EXPECT_EQ(full.out, "");

  const Outcome later = relign_bench(place, {"run", "tiny.json", "--progress", "none"});
  EXPECT_EQ(later.exit_code, 0) << later.err;
  const Outcome fresh = relign_bench(place, {"run", "tiny.json", "--progress", "none", "-o", "fresh"});
  EXPECT_EQ(fresh.exit_code, 0) << fresh.err;
  EXPECT_EQ(place.read("results/tiny/trials/0000.jsonl"), place.read("fresh/trials/0000.jsonl"));
}

TEST(CliMistakes, NamesADeletedWorkingFolder) {
  const Workplace place;
  for (const char* arguments : {"try random --noise-level rho0", "validate suite.json", "doctor"}) {
    const std::string script = "mkdir gone; cd gone; rmdir ../gone; exec \"$RELIGN_BENCH\" ";
    const Outcome outcome = shell(place, script + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr("the working folder was deleted; change to a folder that exists\n"))
        << arguments;
    EXPECT_THAT(outcome.err, Not(HasSubstr("''"))) << arguments;
  }
}

TEST(CliMistakes, RejectsCorruptPlugin) {
  const Workplace place;
  fs::copy(fs::path(kOutOfTree) / "compass", place.path("compass"), fs::copy_options::recursive);
  place.write("compass/compass.so", "not a library");
  expect_mistake(place, {"try", "compass", "--plugin", "compass"}, 5,
                 AllOf(HasSubstr("compass"), HasSubstr("what to do")));
  expect_mistake(place, {"list", "--plugin", "nothing/here"}, 5, HasSubstr("nothing/here"));
}

}  // namespace
}  // namespace relign::cli_test
