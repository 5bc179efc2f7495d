// relign-bench lens: golden rays, first-order data, mesh files, and errors.
#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test::lens {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// Without its closing brace.
const std::string kSceneOfALens = R"({"use": "lens_system", "name": "s", "lens": "lens.json",
    "pivot_behind_first_vertex_mm": 0, "sensor": {"z_mm": 20, "pixels": [20, 20], "pitch_um": 100},
    "emitter": {"z_mm": -50, "side_mm": 100}, "travel": {"shift_mm": [1, 1, 1], "tilt_deg": [3, 3]})";
const std::string kGolden = std::string(RELIGN_TEST_DATA) + "/golden_rays_relign_od.json";

double largest_difference(const json& a, const json& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, a.at(i).is_array() ? largest_difference(a.at(i), b.at(i))
                                                   : std::fabs(a.at(i).get<double>() - b.at(i).get<double>()));
  return largest;
}

TEST(CliLens, TracesGoldenRays) {
  const Workplace place;
  const Outcome outcome = relign_bench(place, {"lens", "trace", kGolden});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json ours = json::parse(outcome.out);
  std::ifstream file(kGolden);
  const json golden = json::parse(file);
  ASSERT_EQ(ours.at("rays").size(), golden.at("rays").size());
  for (std::size_t i = 0; i < golden.at("rays").size(); ++i)
    for (const char* key : {"hits_mm", "image_mm", "exit_direction"})
      EXPECT_LT(largest_difference(ours.at("rays").at(i).at(key), golden.at("rays").at(i).at(key)), 1e-10) << i << key;
  // The output is valid input.
  place.write("again.json", outcome.out);
  const Outcome again = relign_bench(place, {"lens", "trace", "again.json"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.out, outcome.out);
}

// RELIGN_UPDATE_GOLDEN=1 updates the approved text.
TEST(CliLens, InfoAndDrawAcceptMirrorsAndRenderRejectsThem) {
  const Workplace place;
  const std::string lens = std::string(RELIGN_TEST_DATA) + "/lenses/ritchey_chretien.seq";
  const std::string approved = std::string(RELIGN_TEST_DATA) + "/lens_info_mirrors.txt";
  const Outcome info = relign_bench(place, {"lens", "info", lens});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_THAT(info.err, HasSubstr("no obstruction between mirrors"));
  if (std::getenv("RELIGN_UPDATE_GOLDEN") != nullptr) std::ofstream(approved) << info.out;
  std::ifstream file(approved);
  EXPECT_EQ(info.out, std::string(std::istreambuf_iterator<char>(file), {}));
  const Outcome drawn = relign_bench(place, {"lens", "draw", lens, "-o", "telescope.svg"});
  ASSERT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_THAT(place.read("telescope.svg"), testing::AllOf(HasSubstr(">M1<"), HasSubstr(">M2<")));
  const Outcome scene = relign_bench(place, {"scene", "new", lens, "-o", "telescope"});
  EXPECT_EQ(scene.exit_code, 2);
  EXPECT_THAT(scene.err, HasSubstr("ritchey_chretien.seq:9: surface S1 is a mirror, which images do not support"));
  // A lens file of ours keeps them.
  place.write("lens.json", R"({"format": 1, "name": "m", "image_z_mm": -100, "elements": [{"name": "M1", "faces":
      [{"z_mm": 0, "radius_mm": -200, "conic": -1, "mirror": true, "clear_radius_mm": 60}]}],
      "stops": [{"name": "s", "aperture": true, "z_mm": 0, "opening_radius_mm": 50, "on_face": 1}]})");
  EXPECT_EQ(relign_bench(place, {"lens", "info", "lens.json"}).exit_code, 0);
  place.write("scene.json", kSceneOfALens + "}");
  const Outcome rendered = relign_bench(place, {"render", "--scene", "scene.json", "-o", "a.png"});
  EXPECT_EQ(rendered.exit_code, 2);
  EXPECT_THAT(rendered.err, HasSubstr("lens.json: the lens has mirrors, which images do not support"));
}

TEST(CliLens, InfoMatchesPublishedValues) {
  const Workplace place;
  const Outcome text = relign_bench(place, {"lens", "info"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("entrance_pupil_z          5.8206     5.8206"));
  EXPECT_THAT(text.out, HasSubstr("distortion at 42.05 degrees: -27.18 %"));
  const Outcome outcome = relign_bench(place, {"lens", "info", "--json"});
  const json info = json::parse(outcome.out);
  for (const auto& [name, value] : info.at("published").items())
    EXPECT_NEAR(info.at("first_order").at(name).get<double>(), value.get<double>(), 0.5e-4) << name;
}

// Two f-numbers only for lenses whose stop is wider than the design's specified aperture; imported lenses have one.
TEST(CliLens, InfoPrintsBothFNumbersIfTheyDiffer) {
  const Workplace place;
  const auto f_numbers = [&](const std::string& scene) {
    const Outcome outcome = relign_bench(place, {"lens", "info", "--scene", scene, "--json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return json::parse(outcome.out).at("first_order");
  };
  EXPECT_NEAR(f_numbers("relign_od").at("f_number").get<double>(), 2.1, 1e-4);
  EXPECT_NEAR(f_numbers("relign_od").at("f_number_of_opening").get<double>(), 2.0636, 1e-4);
  EXPECT_FALSE(f_numbers("cooke_triplet").contains("f_number_of_opening"));
  const std::string lens = std::string(RELIGN_TEST_DATA) + "/lenses/cooke_triplet.seq";
  const Outcome made = relign_bench(place, {"scene", "new", lens, "-o", "new", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(json::parse(made.out).at("layout").at("f-number"), "4.99998");
  EXPECT_NEAR(f_numbers("new/scene.json").at("f_number").get<double>(), 4.99998, 5e-6);
  EXPECT_FALSE(f_numbers("new/scene.json").contains("f_number_of_opening"));
  // Simulated: parallel rays pass up to 5 mm from the axis.
  const json rays = {{{"start_mm", {0, 4.95, -1}}, {"direction", {0, 0, 1}}},
                     {{"start_mm", {0, 5.05, -1}}, {"direction", {0, 0, 1}}}};
  place.write("rays.json", json({{"rays", rays}}).dump());
  const Outcome traced =
      relign_bench(place, {"lens", "trace", "rays.json", "--scene", "new/scene.json", "--apertures", "mesh"});
  ASSERT_EQ(traced.exit_code, 0) << traced.err;
  const json found = json::parse(traced.out).at("rays");
  EXPECT_EQ(found.at(0).value("lost_at", ""), "") << found.at(0);
  EXPECT_EQ(found.at(1).value("lost_at", ""), "L2 back: outside the opening of its stop") << found.at(1);
}

TEST(CliLens, InfoAndDrawAcceptDesignFiles) {
  const Workplace place;
  const std::string file = std::string(RELIGN_TEST_DATA) + "/lenses/cooke_triplet_utf8.zmx";
  ASSERT_EQ(relign_bench(place, {"scene", "new", file, "-o", "made"}).exit_code, 0);
  const Outcome scene = relign_bench(place, {"lens", "info", "--json", "--scene", "made/scene.json"});
  const Outcome direct = relign_bench(place, {"lens", "info", "--json", file});
  ASSERT_EQ(direct.exit_code, 0) << direct.err;
  for (const char* key : {"first_order", "wavelength_nm", "half_field_deg", "distortion_percent"})
    EXPECT_EQ(json::parse(direct.out).at(key), json::parse(scene.out).at(key)) << key;
  EXPECT_EQ(relign_bench(place, {"lens", "info", "made/lens.json"}).exit_code, 0);
  ASSERT_EQ(relign_bench(place, {"lens", "draw", file, "-o", "lens.svg"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(place.path("lens.svg")));
  EXPECT_EQ(relign_bench(place, {"lens", "info", file, "--scene", "relign_od"}).exit_code, 2);
  const Outcome red = relign_bench(place, {"lens", "info", "--json", file, "--wavelength", "650"});
  EXPECT_GT(json::parse(red.out).at("first_order").at("focal_length"),
            json::parse(direct.out).at("first_order").at("focal_length"));
  for (const std::vector<std::string>& ours :
       {std::vector<std::string>{"lens", "info"}, {"lens", "info", "made/lens.json"}, {"lens", "draw"}}) {
    std::vector<std::string> arguments = ours;
    arguments.insert(arguments.end(), {"--wavelength", "650"});
    EXPECT_THAT(relign_bench(place, arguments).err, HasSubstr("--wavelength: only for files of design programs"));
  }
}

TEST(CliLens, InfoExplainsUndefinedValues) {
  const Workplace place;
  // A plane plate has no focus.
  place.write("plate.json", R"({"format": 1, "name": "plate", "source": "", "wavelength_nm": 550, "image_z_mm": 9,
    "pivot_z_mm": 0, "half_field_deg": 0, "elements": [{"name": "P", "faces": [
      {"z_mm": 0, "radius_mm": null, "index_after": 1.5, "clear_radius_mm": 5},
      {"z_mm": 2, "radius_mm": null, "clear_radius_mm": 5}]}],
    "stops": [{"name": "s", "z_mm": -1, "opening_radius_mm": 2, "aperture": true}]})");
  const Outcome text = relign_bench(place, {"lens", "info", "plate.json"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out, testing::ContainsRegex("focal_length +not defined +- +the lens has no power"));
  EXPECT_THAT(text.out, testing::Not(testing::ContainsRegex("nan|inf ")));
  const json info = json::parse(relign_bench(place, {"lens", "info", "plate.json", "--json"}).out);
  EXPECT_TRUE(info.at("first_order").at("focal_length").is_null());
  EXPECT_EQ(info.at("not_defined").at("focal_length"), "the lens has no power");
  EXPECT_EQ(info.at("not_defined").at("distortion_percent"), "the lens has no field off the axis");
}

TEST(CliLens, ReportsInvalidInput) {
  const Workplace place;
  EXPECT_EQ(relign_bench(place, {"lens"}).exit_code, 2);
  place.write("rays.json", R"({"rays": [{"start_mm": [0, 0, -1]}]})");
  const Outcome missing = relign_bench(place, {"lens", "trace", "rays.json"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("rays.json:1:11: /rays/0: missing key 'direction'"));
  EXPECT_EQ(relign_bench(place, {"lens", "trace", "none.json"}).exit_code, 2);
  EXPECT_EQ(relign_bench(place, {"lens", "trace", "rays.json", "--apertures", "wide"}).exit_code, 2);
  // A scene file whose lens cannot be read.
  place.write("scene.json", kSceneOfALens + "}");
  place.write("lens.json", "{\"format\": 1,\n \"elements\": 5}");
  const Outcome broken = relign_bench(place, {"lens", "info", "--scene", "scene.json"});
  EXPECT_EQ(broken.exit_code, 2);
  EXPECT_THAT(broken.err, HasSubstr("lens.json:2:14: /elements: expected a list"));
  // Mistakes elsewhere in the scene file are reported too.
  place.write("scene.json", kSceneOfALens + R"(, "colour": "red"})");
  const Outcome unknown = relign_bench(place, {"lens", "info", "--scene", "scene.json"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("/colour: unknown key 'colour'"));
}

TEST(CliLens, ReportsWhereRaysAreLost) {
  const Workplace place;
  place.write("rays.json", R"({"rays": [{"start_mm": [0, 0.9, -1], "direction": [0, 0, 1]}]})");
  const Outcome outcome = relign_bench(place, {"lens", "trace", "rays.json", "--apertures", "mesh"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out).at("rays").at(0).at("lost_at"), "aperture stop: outside the opening");
}

#if RELIGN_HAS_MESHES
TEST(CliLens, MeshesRoundTripToALens) {
  const Workplace place;
  const Outcome written = relign_bench(place, {"lens", "export-mesh", "--pitch", "0.3", "-o", "meshes"});
  ASSERT_EQ(written.exit_code, 0) << written.err;
  EXPECT_THAT(written.out, HasSubstr("meshes/L4.ply"));
  const std::vector<std::string> fit = {"lens",          "fit-mesh", "meshes/L3.ply", "meshes/L1.ply", "meshes/L2.ply",
                                        "meshes/L4.ply", "-o",       "lens.json"};
  std::vector<std::string> fit_json = fit;
  fit_json.emplace_back("--json");
  const Outcome fitted = relign_bench(place, fit_json);
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const json elements = json::parse(fitted.out).at("elements");
  EXPECT_EQ(elements.at(0).at("file"), "meshes/L1.ply") << "in the order of the axis";
  const json back = elements.at(1).at("faces").at(1);
  EXPECT_NEAR(back.at("radius_mm").get<double>(), -7.74558, 2e-5) << "files hold floats";
  EXPECT_LT(back.at("residual_largest_mm").get<double>(), 2e-6);
  EXPECT_THAT(relign_bench(place, fit).out, HasSubstr("L2.ply back"));

  // The fitted lens file is valid and has the same focal length.
  place.write("scene.json", kSceneOfALens + "}");
  const Outcome info = relign_bench(place, {"lens", "info", "--scene", "scene.json", "--json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_NEAR(json::parse(info.out).at("first_order").at("focal_length").get<double>(), 2.895, 1e-4);
}

TEST(CliLens, ReportsInvalidMeshes) {
  const Workplace place;
  EXPECT_EQ(relign_bench(place, {"lens", "export-mesh"}).exit_code, 2) << "no folder";
  EXPECT_EQ(relign_bench(place, {"lens", "export-mesh", "--pitch", "0", "-o", "meshes"}).exit_code, 2);
  ASSERT_EQ(relign_bench(place, {"lens", "export-mesh", "--pitch", "0.5", "-o", "meshes"}).exit_code, 0);
  const Outcome few = relign_bench(place, {"lens", "fit-mesh", "meshes/L1.ply", "-o", "lens.json"});
  EXPECT_EQ(few.exit_code, 2);
  EXPECT_THAT(few.err, HasSubstr("has 4 elements, but the number of meshes is 1"));
  place.write("half.ply", place.read("meshes/L1.ply").substr(0, 4000));
  const Outcome half = relign_bench(place, {"lens", "fit-mesh", "half.ply"});
  EXPECT_EQ(half.exit_code, 2);
  EXPECT_THAT(half.err, HasSubstr("half.ply: the file is truncated"));
  EXPECT_EQ(relign_bench(place, {"lens", "fit-mesh", "none.ply"}).exit_code, 2);
}
#endif

}  // namespace
}  // namespace relign::cli_test::lens
