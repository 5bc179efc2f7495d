// The set-up around an imported lens, against the paper's own set-up and against rays.
#include "lens_files/scene_layout.h"

#include <gmock/gmock.h>

#include <cmath>

#include "error_text.h"
#include "golden_lens.h"
#include "lens_files/axial_rays.h"
#include "optics/first_order.h"

namespace relign::lens_files {
namespace {

using test::error_text;
using testing::HasSubstr;

struct Made {
  LensDesign design;
  CompleteLens lens;
  Layout layout;
};
Made made(const std::string& name, const LayoutChoices& choices) {
  Made result;
  result.design = golden_design(name);
  result.lens = complete_lens(result.design, draft_lens(result.design, {}, choices.name, 0));
  result.layout = lay_out(result.design, result.lens, choices);
  return result;
}
LayoutChoices choices_of(const std::string& sensor = "") {
  LayoutChoices choices;
  choices.name = "od";
  if (!sensor.empty()) choices.sensor = parse_sensor(sensor, "--sensor");
  return choices;
}

TEST(SceneLayout, PapersSensorGivesPapersEmitter) {
  // The paper takes the sine of its exit cone for 1 / (2 f-number), hence the difference of half a percent.
  const Made paper = made("relign_od.lis", choices_of("5.22249573"));
  const OrderedJson& scene = paper.layout.scene;
  EXPECT_NEAR(scene["emitter"]["z_mm"].get<double>() + 8.5708805, -123.82, 1.0);
  EXPECT_EQ(scene["pivot_behind_first_vertex_mm"], 8.5708805);
  EXPECT_EQ(scene["sensor"]["side_mm"], 5.22249573);
  EXPECT_EQ(scene["sensor"]["pixels"], 200);
  EXPECT_EQ(scene["travel"]["shift_mm"][0], 0.783);
}

TEST(SceneLayout, SensorSitsAtBestFocusAndHoldsTheImage) {
  LayoutChoices choices = choices_of();
  choices.distance_mm = 200;
  const Made one = made("relign_od.lis", choices);
  const double z = one.layout.scene["sensor"]["z_mm"].get<double>() + 8.5708805;
  EXPECT_NEAR(z, best_focus_z(one.lens.lens, 200), 1e-6);
  EXPECT_GT(one.layout.scene["sensor"]["side_mm"].get<double>(), 2 * image_height(one.lens.lens, 42.05, 200, z));
  EXPECT_NEAR(one.layout.scene["emitter"]["z_mm"].get<double>(), -208.5708805, 1e-9);
}

TEST(SceneLayout, WritesColumnsAndRows) {
  const Made one = made("relign_od.lis", choices_of("1920x1280@3.45"));
  EXPECT_EQ(one.layout.scene["sensor"]["pixels"], OrderedJson({1920, 1280}));
  EXPECT_EQ(one.layout.scene["sensor"]["pitch_um"], 3.45);
  EXPECT_FALSE(one.layout.scene["sensor"].contains("side_mm"));
}

TEST(SceneLayout, TolerancesNameEveryElement) {
  const Made one = made("relign_od.lis", choices_of());
  EXPECT_EQ(one.layout.tolerances["elements"].size(), 4U);
  EXPECT_EQ(one.layout.tolerances["elements"]["L3"]["pivot"], "own_front");
  EXPECT_EQ(one.layout.suite["protocol"], "blind");
  EXPECT_EQ(one.layout.suite["noise_levels"][0], "tolerances.json");
}

TEST(SceneLayout, TolerancesGrowWithTheLens) {
  const auto first_element = [](const std::string& zmx) {
    LensDesign design = read_zmx(zmx, "a.zmx");
    const CompleteLens lens = complete_lens(design, draft_lens(design, {}, "a", 0));
    const Layout layout = lay_out(design, lens, choices_of());
    EXPECT_TRUE(std::any_of(layout.lines.begin(), layout.lines.end(),
                            [&](const LayoutLine& line) { return line.value == layout.grade; }));
    return layout.tolerances["elements"]["L1"];
  };
  // 50.7 mm.
  EXPECT_EQ(first_element(small_zmx())["shift_um"], OrderedJson({100, 100, 100}));
  EXPECT_EQ(first_element(small_zmx())["tilt_arcmin"], OrderedJson({12, 12}));
  // A tenth of it, and between.
  const auto scaled = [&](const std::string& factor) {
    std::string text = replaced(small_zmx(), "UNIT MM", "UNIT " + factor);
    return first_element(text);
  };
  EXPECT_EQ(scaled("METER")["shift_um"], OrderedJson({100, 100, 100}));
  const Made paper = made("relign_od.lis", choices_of());  // 2.9 mm
  EXPECT_EQ(paper.layout.tolerances["elements"]["L1"]["shift_um"], OrderedJson({10, 10, 10}));
  EXPECT_EQ(paper.layout.tolerances["elements"]["L1"]["tilt_arcmin"], OrderedJson({3, 3}));
  std::string middle = replaced(replaced(replaced(small_zmx(), "CURV 0.02", "CURV 0.04"), "CURV -0.02", "CURV -0.04"),
                                "DISZ 4\n", "DISZ 7\n");  // half the radii: 25 mm
  EXPECT_EQ(first_element(middle)["shift_um"], OrderedJson({50, 50, 50}));
  EXPECT_EQ(first_element(middle)["tilt_arcmin"], OrderedJson({8, 8}));
}

TEST(SceneLayout, RemarksOnMismatches) {
  const Made small = made("relign_od.lis", choices_of("2"));
  EXPECT_THAT(small.design.remarks.back().text, HasSubstr("larger than the sensor, 2.000 mm"));
  LayoutChoices close = choices_of();
  close.distance_mm = 1e-3;
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { made("relign_od.lis", close); }), HasSubstr("relign_od.lis: "));
}

LensDesign laid_out(const std::string& zmx) {
  LensDesign design = read_zmx(zmx, "a.zmx");
  const CompleteLens lens = complete_lens(design, draft_lens(design, {}, "a", 0));
  lay_out(design, lens, choices_of());
  return design;
}
bool says(const LensDesign& design, const std::string& text) {
  const std::vector<std::string> lines = remark_lines(design);
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string& line) { return line.find(text) != std::string::npos; });
}

TEST(SceneLayout, RemarksOnImagePlaneFarFromBestFocus) {
  EXPECT_FALSE(says(laid_out(small_zmx()), "the design's image plane"));
  std::string text = replaced(small_zmx(), "DISZ 47.6", "DISZ 80");
  EXPECT_TRUE(says(laid_out(text), "a.zmx: the design's image plane is 81.00 mm behind the last face"));
}

TEST(SceneLayout, ComparesPrintedValues) {
  LensDesign design = golden_design("relign_od.lis");
  design.published["focal_length"] = 3.1;
  const CompleteLens lens = complete_lens(design, draft_lens(design, {}, "od", 0));
  lay_out(design, lens, choices_of());
  EXPECT_THAT(remark_lines(design).back(), HasSubstr("focal_length is 2.89501 mm here, the file states 3.10000"));
}

TEST(SceneLayout, RejectsLensesWithoutImage) {
  std::string text = replaced(small_zmx(), "CURV 0.02", "CURV -0.02");
  text.replace(text.find("CURV -0.02", text.find("SURF 2")), 10, "CURV 0.02");
  LensDesign design = read_zmx(text, "a.zmx");
  const CompleteLens lens = complete_lens(design, draft_lens(design, {}, "a", 0));
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { lay_out(design, lens, choices_of()); }),
              HasSubstr("a.zmx: found a focal length of -"));
}

OrderedJson wavelengths_of(const LensDesign& read) {
  LensDesign design = read;
  LayoutChoices choices = choices_of();
  GlassSources sources;
  sources.is_known = [](const std::string&) { return true; };
  const CompleteLens lens = complete_lens(design, draft_lens(design, sources, "a", 0, true));
  EXPECT_FALSE(lay_out(design, lens, choices).scene.contains("wavelengths"));
  choices.polychromatic = true;
  const Layout layout = lay_out(design, lens, choices);
  EXPECT_EQ(layout.lines[1].what, "wavelengths of images");
  return layout.scene["wavelengths"];
}

TEST(SceneLayout, PolychromaticSceneHasWavelengthsAndWeights) {
  // FTYP: four are used. One is switched off by its weight, one stands twice, one has no weight.
  std::string zmx = replaced(small_zmx("", "WAVM 2 0.6562725 0.5\nWAVM 3 0.55 2\nWAVM 4 0.48 0\nWAVM 5 0.4 1\n"),
                             "FTYP 0 0 1 1", "FTYP 0 0 1 4");
  EXPECT_EQ(wavelengths_of(read_zmx(zmx, "a.zmx")),
            OrderedJson::parse(R"([{"nm": 550.0, "weight": 3.0}, {"nm": 656.2725, "weight": 0.5}])"));
  EXPECT_EQ(wavelengths_of(read_design(small_seq("", "WL 656.3 550 486.1\nWTW 1 2\nREF 2"), "a.seq")),
            OrderedJson::parse(
                R"([{"nm": 656.3, "weight": 1.0}, {"nm": 550.0, "weight": 2.0}, {"nm": 486.1, "weight": 1.0}])"));
  const LensDesign dark = read_zmx(small_zmx("", "WAVM 1 0.55 0\n"), "a.zmx");
  EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { wavelengths_of(dark); }),
              HasSubstr("found 0 wavelengths with a weight above 0 in the file, allowed are 1 to 24"));
}

TEST(SceneLayout, ChartOfACameraIsAsWideAsASmallSensor) {
  LayoutChoices choices = choices_of("640x480@2um");
  const double whole = made("relign_od.lis", choices).layout.scene["emitter"]["side_mm"];
  choices.camera = true;
  const Made camera = made("relign_od.lis", choices);
  const OrderedJson& scene = camera.layout.scene;
  const optics::Prescription& lens = camera.lens.lens;
  const double pivot = scene["pivot_behind_first_vertex_mm"], side = scene["emitter"]["side_mm"];
  const double distance = -scene["emitter"]["z_mm"].get<double>() - pivot;
  const double field_deg =
      std::atan(side / 2 / (distance + optics::first_order(lens).entrance_pupil_z)) * 57.29577951308232;
  EXPECT_LT(side, 0.5 * whole);
  EXPECT_NEAR(image_height(lens, field_deg, distance, scene["sensor"]["z_mm"].get<double>() + pivot), 1.02 * 0.64,
              1e-4);
  // A large sensor does not make it larger than the field.
  choices.sensor = parse_sensor("640x480@200um", "--sensor");
  const double large = made("relign_od.lis", choices).layout.scene["emitter"]["side_mm"];
  choices.camera = false;
  EXPECT_EQ(large, made("relign_od.lis", choices).layout.scene["emitter"]["side_mm"].get<double>());
}

TEST(ParseSensor, ParsesSizesAndRejectsOthers) {
  EXPECT_EQ(parse_sensor("640x480@5", "--sensor").rows, 480);
  EXPECT_DOUBLE_EQ(parse_sensor("640x480@5", "--sensor").shorter_side_mm(), 2.4);
  EXPECT_DOUBLE_EQ(parse_sensor("640x480@5um", "--sensor").longer_side_mm(), 3.2);
  EXPECT_DOUBLE_EQ(parse_sensor("4.8", "--sensor").shorter_side_mm(), 4.8);
  for (const char* wrong : {"", "x", "0", "-3", "640x480", "640@5", "5@640x480", "0x5@3", "1.5x2@3", "9000x10@1",
                            "10x10@0", "10x10@um", "10x10@3mm", "8000x8000@1000"})
    EXPECT_THAT(error_text(ErrorKind::bad_input, [&] { parse_sensor(wrong, "--sensor"); }), HasSubstr("--sensor '"))
        << wrong;
}

TEST(Readme, HasEveryNumberAndRemark) {
  const Made one = made("relign_od.lis", choices_of());
  const std::string text = readme(one.design, one.lens, choices_of(), one.layout);
  EXPECT_THAT(text, HasSubstr("| focal length | 2.89501 mm | first order |"));
  EXPECT_THAT(text, HasSubstr("* relign_od.lis:25: vignetting factors are used only"));
}

double best_focus_of(const std::string& zmx) {
  LensDesign design = read_zmx(zmx, "a.zmx");
  return best_focus_z(complete_lens(design, draft_lens(design, {}, "a", 0)).lens, 0);
}

// Rays outside a semi-diameter must not affect the best focus.
TEST(SceneLayout, BestFocusUsesLightWithinSemiDiameters) {
  const std::string wide = replaced(small_zmx(), "ENPD 10", "ENPD 20"), clipped = replaced(wide, "DIAM 12", "DIAM 5");
  EXPECT_NEAR(best_focus_of(clipped), best_focus_of(small_zmx()), 0.02);
  EXPECT_GT(best_focus_of(small_zmx()) - best_focus_of(wide), 0.3);
}

TEST(SceneLayout, DistancesCountFromTheFirstVertex) {
  const std::string text = replaced(small_zmx(), "SURF 0\n  DISZ INFINITY\nSURF 1\n", "SURF 0\n  DISZ 400\nSURF 1\n");
  LensDesign near = read_zmx(text, "a.zmx");
  draft_lens(near, {}, "a", 0);
  EXPECT_EQ(near.object_distance_mm(), 400.0);
  std::string with_dummy = replaced(text, "SURF 1\n", "SURF 1\n  DISZ 25\nSURF 2\n");
  with_dummy = replaced(with_dummy, "SURF 4\n  DISZ 0", "SURF 5\n  DISZ 0");
  with_dummy = replaced(with_dummy, "SURF 3\n  STOP", "SURF 4\n  STOP");
  with_dummy = replaced(with_dummy, "SURF 2\n  CURV -0.02", "SURF 3\n  CURV -0.02");
  LensDesign design = read_zmx(with_dummy, "a.zmx");
  const CompleteLens lens = complete_lens(design, draft_lens(design, {}, "a", 0));
  EXPECT_EQ(design.object_distance_mm(), 425.0);
  const Layout layout = lay_out(design, lens, choices_of());
  EXPECT_EQ(layout.scene["emitter"]["z_mm"], -(425 + layout.scene["pivot_behind_first_vertex_mm"].get<double>()));
}

}  // namespace
}  // namespace relign::lens_files
