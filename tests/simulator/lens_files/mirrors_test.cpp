// Lens files with mirrors: supported by `lens info` and `lens draw`, rejected for images.
#include <gmock/gmock.h>

#include <cmath>

#include "error_text.h"
#include "golden_lens.h"
#include "lens_files/axial_rays.h"
#include "lens_files/completion.h"
#include "lens_files/scene_layout.h"
#include "optics/first_order.h"

namespace relign::lens_files {
namespace {

using test::error_text;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;

CompleteLens complete(LensDesign& design) { return complete_lens(design, draft_lens(design, {}, "a", 0)); }
std::string refusal(const std::string& text, const std::string& file) {
  return error_text(ErrorKind::bad_input, [&] {
    LensDesign design = read_design(text, file);
    complete(design);
  });
}

// The f/16 Ritchey-Chretien of a public CODE V file.
const std::string kTelescope =
    "RDM; LEN\nDIM M\nEPD 3962.4\nWL 550\nYAN 0 0.1\nSO 0 1e11\n"
    "S -21335.137 -7490.46 REFL\n STO; CON; K -1.0961\n"
    "S -9576.712 9441.833 REFL\n CON; K -5.1628\nSI 0 0\n";

// The same in Zemax's words, with a plane before the first mirror; `extra` goes into surface 2.
std::string zemax_telescope(const std::string& extra = "") {
  return "MODE SEQ\nUNIT MM\nENPD 3962.4\nFTYP 0 0 1 1\nYFLN 0.1\nWAVM 1 0.55 1\nPWAV 1\nSURF 0\n  DISZ INFINITY\n"
         "SURF 1\n  DISZ 8000\nSURF 2\n  STOP\n  CURV -4.6871037200276712e-05\n  CONI -1.0961\n  DISZ -7490.46\n"
         "  GLAS MIRROR 0 0 1.5 40\n" +
         extra +
         "SURF 3\n  CURV -1.0441997211569066e-04\n  CONI -5.1628\n  DISZ 9441.833\n  GLAS MIRROR 0 0 1.5 40\n"
         "SURF 4\n  DISZ 0\n";
}

// ray-optics 0.9.8 finds 31702.2156 and 9441.8310 mm, too.
void expect_telescope(const optics::Prescription& lens) {
  const optics::FirstOrder data = optics::first_order(lens);
  const double f1 = 21335.137 / 2, f2 = -9576.712 / 2, f = 1 / (1 / f1 + 1 / f2 - 7490.46 / (f1 * f2));
  EXPECT_NEAR(data.focal_length, f, 1e-6 * f);
  EXPECT_NEAR(data.back_focal_length, f * (f1 - 7490.46) / f1, 1e-6 * f);
  EXPECT_NEAR(data.image_distance, 9441.833, 1e-6);
  EXPECT_NEAR(data.entrance_pupil_diameter, 3962.4, 1e-9);
  EXPECT_NEAR(best_focus_z(lens, 0) - data.overall_length, data.back_focal_length, 1);
  ASSERT_EQ(lens.elements.size(), 2U);
  EXPECT_EQ(lens.elements[0].name, "M1");
  EXPECT_EQ(lens.elements[1].name, "M2");
  // As wide as the light needs, plus a margin.
  EXPECT_NEAR(lens.elements[0].faces[0].clear_radius_mm, 1.03 * 1981.2, 5);
}

TEST(Mirrors, ReadsTelescopesOfBothPrograms) {
  LensDesign code_v = read_design(kTelescope, "a.seq"), zemax = read_design(zemax_telescope(), "a.zmx");
  expect_telescope(complete(code_v).lens);
  expect_telescope(complete(zemax).lens);
  EXPECT_THAT(code_v.remarks, Contains(Field(&Remark::text, HasSubstr("no obstruction between mirrors"))));
}

TEST(Mirrors, AManginMirrorIsOneElementOfThreeFaces) {
  LensDesign design = read_design(
      "RDM; LEN\nDIM M\nEPD 200\nWL 555\nYAN 0 .333\nSO 0 1e11\nS -1200 10 1.5168 64.17\n STO\nS -1000 -10 REFL\n"
      "S -1200 -500\nSI 0 0\n",
      "a.seq");
  const CompleteLens made = complete(design);
  ASSERT_EQ(made.lens.elements.size(), 1U);
  const std::vector<optics::Face>& faces = made.lens.elements[0].faces;
  ASSERT_EQ(faces.size(), 3U);
  EXPECT_TRUE(faces[1].mirror);
  EXPECT_EQ(faces[1].index_after, -faces[0].index_after);
  EXPECT_EQ(faces[2].index_after, -1);
  // Thin lens, mirror, thin lens: 2 (n - 1) c1 - 2 n c2, less than a percent off for its thickness.
  const double n = faces[0].index_after, power = 2 * (n - 1) / -1200 - 2 * n / -1000;
  EXPECT_NEAR(optics::first_order(made.lens).focal_length * power, 1, 0.02);
  EXPECT_LT(optics::first_order(made.lens).back_focal_length, 0);
}

TEST(Mirrors, RejectsImagesWithSurfaceAndLine) {
  LensDesign design = read_design(zemax_telescope(), "a.zmx");
  const CompleteLens made = complete(design);
  const std::string text = error_text(ErrorKind::bad_input, [&] { lay_out(design, made, LayoutChoices()); });
  EXPECT_THAT(text, HasSubstr("a.zmx:12: surface 2 is a mirror, which images do not support"));
  EXPECT_THAT(text, HasSubstr("a.zmx:18: surface 3 is a mirror"));
}

TEST(Mirrors, RejectsTiltedMirrorsAndWrongSigns) {
  std::string folded = kTelescope;
  folded.replace(folded.find("CON; K -1.0961"), 14, "ADE 45; DAR");
  EXPECT_THAT(
      refusal(folded, "a.seq"),
      HasSubstr("a.seq:7: surface S1 is a mirror that is tilted or off the axis; supported are mirrors on the axis"));
  std::string behind = kTelescope;
  behind.replace(behind.find(" 9441.833"), 9, " -9441.833");
  EXPECT_THAT(refusal(behind, "a.seq"), HasSubstr("a.seq:11: the image is in front of the last face, along the light"));
}

}  // namespace
}  // namespace relign::lens_files
