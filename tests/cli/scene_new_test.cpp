// relign-bench scene new: from a design program's file to a suite that runs, and errors.
#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

std::string golden(const std::string& name) { return std::string(RELIGN_TEST_DATA) + "/lenses/" + name; }

json parsed(const Workplace& place, const std::string& file) { return json::parse(place.read(file)); }

TEST(CliSceneNew, PolychromaticSceneHasTheFilesWavelengths) {
  const Workplace place;
  const Outcome made = relign_bench(place, {"scene", "new", golden("cooke_triplet_utf8.zmx"), "-o", "white", "--sensor",
                                            "60x40@500", "--polychromatic"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("480, 550, 650 nm"));
  EXPECT_THAT(made.out, Not(HasSubstr("not used: the wavelength")));
  EXPECT_EQ(parsed(place, "white/scene.json").at("wavelengths"),
            json::parse(R"([{"nm": 480, "weight": 1}, {"nm": 550, "weight": 1}, {"nm": 650, "weight": 1}])"));
  const Outcome rendered = relign_bench(place, {"render", "--scene", "white/scene.json", "-o", "white.png"});
  EXPECT_EQ(rendered.exit_code, 0) << rendered.err;
  // Its glasses are private ones of CODE V with an index at one wavelength.
  const Outcome indices = relign_bench(
      place, {"scene", "new", golden("relign_od.lis"), "-o", "od", "--sensor", "60x40@85", "--polychromatic"});
  EXPECT_EQ(indices.exit_code, 2);
  EXPECT_THAT(indices.err, testing::AllOf(HasSubstr("od/lens.json:"), HasSubstr("needs the glass of L1"),
                                          HasSubstr("nothing was written")));
}

TEST(CliSceneNew, CameraHasFieldsElectronicsAndASpecificationThatTheDesignMeets) {
  const Workplace place;
  const std::string lens = RELIGN_SOURCE_DIR "/examples/lens/triplet.zmx";
  const Outcome made = relign_bench(
      place, {"scene", "new", lens, "-o", "line", "--camera", "480x360@4um", "--stage", "stepper", "--lenses", "1"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const json scene = parsed(place, "line/scene.json"), suite = parsed(place, "line/suite.json");
  EXPECT_EQ(scene.at("emitter").at("target"), "camera_chart:squares=5");
  const json& spec = scene.at("spec").at("field_mtf");
  EXPECT_DOUBLE_EQ(spec.at("lp_per_mm").get<double>(), 31.25) << "a quarter of 125 lp/mm";
  EXPECT_GT(spec.at("tangential").get<double>(), 0.5);
  EXPECT_LT(spec.at("tangential").get<double>(), 0.8);
  EXPECT_THAT(suite.at("algorithms").dump(), HasSubstr("field-focus"));
  EXPECT_EQ(suite.at("analysis").at("primary"), "yield");
  EXPECT_THAT(made.out, HasSubstr("can meet the spec            1 of 1 lens (21 to 100 %)"));
  const json tolerances = parsed(place, "line/tolerances.json");
  EXPECT_EQ(tolerances.at("movement").at("backlash_um"), 3) << "of the preset tolerances-stepper-stage";
  EXPECT_EQ(tolerances.at("start").at("tilt_arcmin").size(), 2U) << "of this scene";
  // White is at 80 % of a full pixel: captures are not clipped, and not dark.
  const json& electronics = scene.at("sensor").at("electronics");
  EXPECT_GT(electronics.at("saturation").get<double>(), 0);
  json one = suite;
  one["instances"] = 1;
  one["steps"] = 1;
  place.write("line/one.json", one.dump());
  const Outcome run = relign_bench(place, {"run", "line/one.json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("MTF by field at 31."));

  const auto refused = [&](const std::vector<std::string>& more) {
    std::vector<std::string> command = {"scene", "new", lens, "-o", "none"};
    command.insert(command.end(), more.begin(), more.end());
    const Outcome outcome = relign_bench(place, command);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_FALSE(std::filesystem::exists(place.path("none")));
    return outcome.err;
  };
  EXPECT_THAT(refused({"--camera", "480x360"}), HasSubstr("--camera '480x360': expected COLUMNSxROWS@PITCH"));
  EXPECT_THAT(refused({"--camera", "480x360@4", "--sensor", "4"}),
              HasSubstr("--sensor cannot be combined with --camera"));
  EXPECT_THAT(refused({"--camera", "60x40@20"}),
              testing::AllOf(HasSubstr("squares of at least 40 pixels"), Not(HasSubstr("--target"))));
  EXPECT_THAT(refused({"--camera", "320x240@6", "--target", "siemens_star"}), HasSubstr("this target has no fields"));
  EXPECT_THAT(refused({"--camera", "480x360@4", "--stage", "granite"}),
              testing::AllOf(HasSubstr("unknown stage 'granite'"), HasSubstr("tolerances-piezo-hexapod")));
  EXPECT_THAT(refused({"--camera", "480x360@4", "--stage", "tolerances"}), HasSubstr("ambiguous stage 'tolerances'"));
  place.write("none.json", "[]");
  EXPECT_THAT(refused({"--spec", "none.json"}), HasSubstr("none.json: expected an object with the limits"));
  place.write("field.json", R"({"field_mtf": {"lp_per_mm": 30, "fields": [{"name": "nowhere", "tangential": 0.3}]}})");
  EXPECT_THAT(refused({"--camera", "480x360@4", "--spec", "field.json"}),
              testing::AllOf(HasSubstr("field.json: "), HasSubstr("'nowhere'")));
  place.write("score.json", R"({"score": 0.005})");
  EXPECT_THAT(refused({"--camera", "480x360@4", "--spec", "score.json"}), HasSubstr("use 'rmse'"));
  place.write("stage.json", R"({"use": "tolerances", "elements": {}, "movement": 5,
                                "start": {"shift_um": [1, 1, 1], "tilt_arcmin": [1, 1]}})");
  EXPECT_THAT(refused({"--camera", "480x360@4", "--stage", "stage.json"}), HasSubstr("with 'movement' is needed"));
  place.write("stage.json", R"({"use": "tolerances", "elements": {}, "movement": {"backlsh_um": 5},
                                "start": {"shift_um": [1, 1, 1], "tilt_arcmin": [1, 1]}})");
  EXPECT_THAT(refused({"--camera", "480x360@4", "--stage", "stage.json"}),
              testing::AllOf(HasSubstr("--stage: "), HasSubstr("stage.json:1:"), HasSubstr("backlsh_um")));
}

TEST(CliSceneNew, RemarksOnACameraThatTheLensDoesNotSuit) {
  const Workplace place;
  place.write("places.json", R"({"centre_px": 4})");
  const Outcome made = relign_bench(place, {"scene", "new", RELIGN_SOURCE_DIR "/examples/lens/triplet.zmx", "-o",
                                            "line", "--camera", "1920x1280@3um", "--spec", "places.json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("does not fill the sensor, whose diagonal is 6.923 mm"));
  EXPECT_THAT(made.out, HasSubstr("can meet the spec            not judged"));
  EXPECT_THAT(made.out, HasSubstr("coupling of axes 0.01"));
  EXPECT_THAT(made.out, HasSubstr("20 instances, 12 steps"));
  EXPECT_THAT(made.err, HasSubstr("lattice")) << "the picture of the suite";
}

TEST(CliSceneNew, TellsBeforeARunThatASpecificationCannotBeMet) {
  const Workplace place;
  place.write("spec.json", R"({"field_mtf": {"lp_per_mm": 100, "tangential": 0.99, "sagittal": 0.99}})");
  const Outcome made = relign_bench(place, {"scene", "new", RELIGN_SOURCE_DIR "/examples/lens/triplet.zmx", "-o",
                                            "line", "--camera", "480x360@4", "--spec", "spec.json", "--lenses", "1"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string expected =
      "the lens as designed misses the specification at its best pose: the MTF of its worst field is 0.";
  EXPECT_THAT(made.err, HasSubstr("line: " + expected));
  EXPECT_THAT(made.out, HasSubstr("0 of 1 lens (0 to 79 %)"));
  EXPECT_THAT(place.read("line/README.md"), HasSubstr(expected));
  const Outcome valid = relign_bench(place, {"validate", "line/suite.json", "--lenses", "1", "--json"});
  ASSERT_EQ(valid.exit_code, 0) << valid.err;
  EXPECT_THAT(valid.err, HasSubstr("triplet, tolerances: " + expected));
  const json found = json::parse(valid.out).at("can_meet_spec").at(0);
  EXPECT_EQ(found.at("possible"), 0);
  EXPECT_GT(found.at("design").at("field_mtf_deficit"), 0.05);
}

TEST(CliSceneNew, CreatesRunnableSuiteFromListing) {
  const Workplace place;
  const Outcome made =
      relign_bench(place, {"scene", "new", golden("relign_od.lis"), "-o", "od", "--sensor", "60x40@85"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("focal length                 2.89501 mm"));
  EXPECT_THAT(made.out, HasSubstr("relign_od.lis:25: vignetting factors are used only"));
  EXPECT_THAT(made.err, HasSubstr("relign-bench run od/suite.json"));
  EXPECT_THAT(place.read("od/README.md"), HasSubstr("relign-bench run suite.json"));

  const double spec = parsed(place, "od/scene.json").at("spec").at("rmse");
  EXPECT_GT(spec, 0.001);

  // The generated suite, shortened.
  json suite = parsed(place, "od/suite.json");
  EXPECT_EQ(suite.at("protocol"), "blind");
  EXPECT_THAT(suite.at("algorithms").dump(), HasSubstr("through-focus-quick"));
  EXPECT_THAT(made.out, HasSubstr("of a noise-free image shifted sideways by one pixel"));
  suite["instances"] = 1;
  suite["steps"] = 3;
  place.write("od/suite.json", suite.dump());
  const Outcome valid = relign_bench(place, {"validate", "od/suite.json"});
  ASSERT_EQ(valid.exit_code, 0) << valid.err;
  EXPECT_EQ(json::parse(place.read("od/suite.json")).at("name"), "od") << "so that its results have their own folder";
  const Outcome ran = relign_bench(place, {"run", "od/suite.json", "-o", "results", "--workers", "2"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(place.read("results/curves.csv"), HasSubstr("\nrelign_od,tolerances,blind,nlopt-sbplx,"));
  // The generated specification gives a yield.
  const Outcome table = relign_bench(place, {"report", "results", "--format", "csv", "-o", "table.csv"});
  ASSERT_EQ(table.exit_code, 0) << table.err;
  EXPECT_THAT(place.read("table.csv"), HasSubstr("," + std::to_string(spec).substr(0, 5)));
  // The suggested command works.
  const std::string watch = " --scene od/scene.json --noise-level od/tolerances.json --protocol blind --steps 3";
  const std::size_t named = ran.err.find("relign-bench try ");
  ASSERT_NE(named, std::string::npos) << ran.err;
  const std::string typed = ran.err.substr(named + std::string("relign-bench ").size());
  EXPECT_THAT(typed, HasSubstr(watch)) << "the options of the suite";
  const Outcome watched = shell(place, "\"$RELIGN_BENCH\" " + typed);
  EXPECT_EQ(watched.exit_code, 0) << watched.err;
}

TEST(CliSceneNew, RendersSharpAndLitImage) {
  const Workplace place;
  ASSERT_EQ(relign_bench(place, {"scene", "new", golden("relign_od.lis"), "-o", "od"}).exit_code, 0);
  const Outcome info = relign_bench(place, {"lens", "info", "--scene", "od/scene.json", "--json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  const json lens = json::parse(info.out);
  for (const auto& [name, value] : lens.at("published").items())
    EXPECT_NEAR(lens.at("first_order").at(name).get<double>(), value.get<double>(), 0.5e-4) << name;
  // The noise-free image of the star is less sharp on either side of best focus.
  const auto image_at = [&](const std::string& pose) {
    const Outcome image =
        relign_bench(place, {"render", "--scene", "od/scene.json", "--pose", pose, "--noise-free", "-o", "image.npy"});
    EXPECT_EQ(image.exit_code, 0) << image.err;
    std::ifstream file(place.path("image.npy"), std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(file)), {});
    const std::size_t count = 200 * 200;
    std::vector<float> values(count);
    std::memcpy(values.data(), bytes.data() + bytes.size() - count * sizeof(float), count * sizeof(float));
    return values;
  };
  const auto contrast = [&](const std::string& pose) {
    double sum = 0, squares = 0;
    for (const float value : image_at(pose)) {
      sum += value;
      squares += static_cast<double>(value) * value;
    }
    return squares / sum;  // sharp edges leave more contrast for the same light
  };
  const double nominal = contrast("0.5,0.5,0.5,0.5,0.5");
  EXPECT_GT(nominal, 0.05);
  EXPECT_GT(nominal, 1.02 * contrast("0.5,0.5,0.4,0.5,0.5"));
  EXPECT_GT(nominal, 1.02 * contrast("0.5,0.5,0.6,0.5,0.5"));
  // The specification is the RMSE at one pixel sideways.
  const json scene = parsed(place, "od/scene.json");
  const double pixel_mm = scene.at("sensor").at("side_mm").get<double>() / 200;
  const double share = 0.5 + pixel_mm / (2 * scene.at("travel").at("shift_mm").at(0).get<double>());
  const std::vector<float> here = image_at("nominal"), beside = image_at(std::to_string(share) + ",0.5,0.5,0.5,0.5");
  double squares = 0;
  for (std::size_t i = 0; i < here.size(); ++i) squares += std::pow(static_cast<double>(here[i]) - beside[i], 2);
  const double rmse = std::sqrt(squares / static_cast<double>(here.size()));
  EXPECT_NEAR(scene.at("spec").at("rmse").get<double>(), rmse, 0.06 * rmse);
}

TEST(CliSceneNew, FindsGlassesBuiltInAndInCatalogues) {
  const Workplace place;
  const std::string lens = golden("cooke_triplet_utf16.zmx");
  const Outcome built_in = relign_bench(place, {"scene", "new", lens, "-o", "built_in"});
  ASSERT_EQ(built_in.exit_code, 0) << built_in.err;
  EXPECT_FALSE(parsed(place, "built_in/lens.json").contains("glasses"));
  const Outcome catalogue = relign_bench(place, {"scene", "new", lens, "-o", "copied", "--glass", golden("cooke.agf")});
  ASSERT_EQ(catalogue.exit_code, 0) << catalogue.err;
  EXPECT_EQ(parsed(place, "copied/lens.json").at("glasses").at("SK16").at("agf_formula"), 1);
  place.write("odd.seq", "EPD 5; WL 550; YAN 3; SO 0 1e14; S 50 4 XK99; CIR 9; S -50 1; CIR 9; S 0 48; STO; SI 0 0\n");
  const Outcome unknown = relign_bench(place, {"scene", "new", "odd.seq", "-o", "new"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("odd.seq:1: surface S1: unknown glass 'XK99'"));
  EXPECT_FALSE(fs::exists(place.path("new")));
}

TEST(CliSceneNew, DerivesFolderNameFromFileName) {
  const Workplace place;
  for (const auto& [file, folder] : {std::pair{"my lens \u00e9.zmx", "my_lens"}, {"\u00fc\u00df 5.zmx", "___5"}}) {
    fs::copy_file(golden("cooke_triplet_utf8.zmx"), place.path(file));
    const Outcome made = relign_bench(place, {"scene", "new", file});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_TRUE(fs::exists(place.path(std::string(folder) + "/scene.json"))) << folder;
    EXPECT_EQ(parsed(place, std::string(folder) + "/scene.json").at("name"), folder);
  }
}

TEST(CliSceneNew, KeepsNamedTargetsAndCopiesTargetFiles) {
  const Workplace place;
  ASSERT_EQ(relign_bench(place, {"render", "--noise-free", "-o", "star.png"}).exit_code, 0);
  const Outcome file =
      relign_bench(place, {"scene", "new", golden("relign_od.lis"), "-o", "file", "--target", "star.png", "--json"});
  ASSERT_EQ(file.exit_code, 0) << file.err;
  EXPECT_EQ(json::parse(file.out).at("elements"), 4);
  EXPECT_EQ(parsed(place, "file/scene.json").at("emitter").at("target"), "target.png");
  EXPECT_TRUE(fs::exists(place.path("file/target.png")));
  const Outcome named =
      relign_bench(place, {"scene", "new", golden("relign_od.lis"), "-o", "named", "--target", "chessboard"});
  ASSERT_EQ(named.exit_code, 0) << named.err;
  EXPECT_EQ(parsed(place, "named/scene.json").at("emitter").at("target"), "chessboard");
}

TEST(CliSceneNew, RejectsInvalidInputWithoutWriting) {
  const Workplace place;
  const auto refused = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"scene", "new"});
    const Outcome outcome = relign_bench(place, arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_FALSE(fs::exists(place.path("new")));
    return outcome.err;
  };
  const std::string lens = golden("relign_od.lis");
  EXPECT_THAT(refused({golden("cooke_triplet_utf16.zmx"), "-o", "new", "--wavelength", "50"}),
              HasSubstr("--wavelength: '50' must be a number from 100 to 100000 nm"));
  EXPECT_THAT(refused({lens, "-o", "new", "--wavelength", "0.55"}), HasSubstr("from 100 to 100000 nm"));
  EXPECT_THAT(refused({lens, "-o", "new", "--distance", "0"}), HasSubstr("from 0.001 to 1000000 mm"));
  EXPECT_THAT(refused({lens, "-o", "new", "--sensor", "100@5"}),
              HasSubstr("--sensor '100@5': expected COLUMNSxROWS@PITCH"));
  EXPECT_THAT(refused({lens, "-o", "new", "--target", "siemens_sta"}), HasSubstr("siemens_sta"));
  EXPECT_THAT(refused({lens, "-o", "new", "--name", "a b"}), HasSubstr("invalid scene name 'a b'"));
  EXPECT_THAT(refused({"missing.zmx", "-o", "new"}), HasSubstr("missing.zmx"));
  EXPECT_THAT(refused({lens, "-o", "new", "--glass", "missing.agf"}), HasSubstr("missing.agf"));
  place.write("odd.zmx", "SURF 0\n  TYPE TOROIDAL\n");
  EXPECT_THAT(refused({"odd.zmx", "-o", "new"}), HasSubstr("odd.zmx:2: surface 0 has unsupported type 'TOROIDAL'"));
  place.write("odd.txt", "no lens\n");
  EXPECT_THAT(refused({"odd.txt", "-o", "new"}), HasSubstr("odd.txt: unknown lens file format"));
  fs::create_directory(place.path("there"));
  const Outcome there = relign_bench(place, {"scene", "new", lens, "-o", "there"});
  EXPECT_EQ(there.exit_code, 2);
  EXPECT_THAT(there.err, HasSubstr("already exists; nothing was written"));
}

}  // namespace
}  // namespace relign::cli_test
