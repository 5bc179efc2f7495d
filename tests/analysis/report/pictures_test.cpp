#include "report/pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/files.h"
#include "report/made_pictures.h"
#include "report/report.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

using Pictures = MadePictures;

TEST_F(Pictures, EmbedsEqualPicturesOnce) {
  put("a.png", made_png());
  put("b.png", made_png());
  put("c.png", made_png("other"));
  write_index({entry("x", "best", "a.png", "c.png"), entry("y", "best", "b.png", "c.png")},
              {{{"scene", "relign_od"}, {"file", "a.png"}}});
  const Gallery gallery = load_gallery(folder_);
  EXPECT_EQ(gallery.pictures.size(), 2u);
  EXPECT_EQ(gallery.pictures[0].width, 2u);
  EXPECT_EQ(gallery.trials[0].start.picture, gallery.trials[1].start.picture);
  EXPECT_EQ(gallery.trials[0].end.step, 9u);
  EXPECT_EQ(gallery.references.at("relign_od").picture, gallery.trials[0].start.picture);
  EXPECT_TRUE(gallery.problems.empty());
}

// An untrusted folder must not bring other files of this machine into a page.
TEST_F(Pictures, ReadsNothingOutsideThePicturesFolder) {
  write_file_atomically(folder_ / "secret.png", made_png());
  put("inside.png", made_png("inside"));
  fs::create_symlink(folder_ / "secret.png", folder_ / "pictures" / "link.png");
  write_index({entry("x", "best", "../secret.png", (folder_ / "secret.png").string()),
               entry("y", "best", "link.png", "./deep/../inside.png")});
  const Gallery gallery = load_gallery(folder_);
  EXPECT_FALSE(gallery.trials[0].start.picture);
  EXPECT_FALSE(gallery.trials[0].end.picture);
  EXPECT_FALSE(gallery.trials[1].start.picture) << "a link to outside the folder";
  EXPECT_TRUE(gallery.trials[1].end.picture);
  EXPECT_EQ(gallery.problems.size(), 3u);
}

TEST_F(Pictures, EmbedsOnlyPng) {
  put("page.png", "<svg onload=alert(1)>");
  put("short.png", made_png().substr(0, 20));
  write_index({entry("x", "best", "page.png", "short.png"), entry("y", "best", "missing.png", "missing.png")});
  const Gallery gallery = load_gallery(folder_);
  EXPECT_TRUE(gallery.pictures.empty());
  EXPECT_THAT(gallery.problems,
              ElementsAre(HasSubstr("short.png: not a valid PNG"), HasSubstr("missing.png: no such picture"),
                          HasSubstr("page.png: not a valid PNG")));
}

TEST_F(Pictures, PrefersTheMedianTrialAtTheLimit) {
  for (const char* name : {"best", "median", "worst"}) put(std::string(name) + ".png", made_png(name));
  write_index({entry("x", "best", "best.png", "best.png"), entry("x", "median", "median.png", "median.png"),
               entry("x", "worst", "worst.png", "worst.png")});
  const std::size_t one = load_gallery(folder_).pictures[0].data_uri.size();
  const Gallery gallery = load_gallery(folder_, one);
  EXPECT_FALSE(gallery.trials[0].end.picture);
  EXPECT_TRUE(gallery.trials[1].end.picture);
  EXPECT_FALSE(gallery.trials[2].end.picture);
  EXPECT_EQ(gallery.left_out, 2u);
}

// The pictures of the best method's median and worst trial, shown beside the curves, are embedded first.
TEST_F(Pictures, PrefersPicturesBesideTheCurves) {
  put("film.webp", made_film());
  for (const char* name : {"a", "b", "c", "d"}) put(std::string(name) + ".png", made_png(name));
  write_index(
      {with_film(entry("other", "median", "a.png", "b.png"), "film.webp"), entry("mine", "worst", "c.png", "d.png")});
  const std::size_t one = load_gallery(folder_).pictures.back().data_uri.size();
  const Gallery gallery = load_gallery(folder_, 2 * one, {{"relign_od", "rho0", "paper", "mine"}});
  EXPECT_TRUE(gallery.trials[1].end.picture);
  EXPECT_TRUE(gallery.trials[1].start.picture) << "no film includes it";
  EXPECT_FALSE(gallery.trials[0].film.picture);
  EXPECT_EQ(gallery.left_out, 3u);
  EXPECT_FALSE(load_gallery(folder_, 2 * one).trials[1].end.picture);
}

TEST_F(Pictures, EmbedsFilmsThatMatchTheIndex) {
  put("a.webp", made_film());
  put("b.webp", made_lossy_film());
  put("cut.webp", made_lossy_film().substr(0, 60));
  put("png.webp", made_png());
  write_index(
      {with_film(entry("lossless", "best", "", ""), "a.webp"), with_film(entry("lossy", "best", "", ""), "b.webp"),
       with_film(entry("cut", "best", "", ""), "cut.webp"), with_film(entry("png", "best", "", ""), "png.webp"),
       with_film(entry("tiles", "best", "", ""), "a.webp", 3), with_film(entry("outside", "best", "", ""), "../a.webp"),
       with_film(entry("huge", "best", "", ""), "a.webp", 4'000'000)});
  const Gallery gallery = load_gallery(folder_);
  ASSERT_EQ(gallery.trials.size(), 7u);
  for (const std::size_t good : {0u, 1u}) {
    ASSERT_TRUE(gallery.trials[good].film.picture) << good;
    const Picture& picture = gallery.pictures[*gallery.trials[good].film.picture];
    EXPECT_EQ(picture.width, 6u);
    EXPECT_EQ(picture.height, 2u);
    EXPECT_EQ(picture.data_uri.rfind("data:image/webp;base64,UklGR", 0), 0u);
  }
  EXPECT_EQ(gallery.trials[0].film.frames[2].step, 9u);
  for (const std::size_t bad : {2u, 3u, 4u, 5u, 6u}) EXPECT_FALSE(gallery.trials[bad].film.picture) << bad;
  EXPECT_THAT(gallery.problems,
              testing::IsSupersetOf({HasSubstr("cut.webp: not a valid WebP"), HasSubstr("png.webp: not a valid WebP"),
                                     HasSubstr("6 x 2 pixels, but the index lists 3 tiles of 3"),
                                     HasSubstr("../a.webp: rejected")}));
}

TEST_F(Pictures, PrefersFilmsToPreviews) {
  put("film.webp", made_film());
  put("start.png", made_png());
  write_index(Json::array({with_film(entry("x", "best", "start.png", "start.png"), "film.webp")}));
  const Gallery gallery = load_gallery(folder_, 100);
  EXPECT_TRUE(gallery.trials[0].film.picture);
  EXPECT_FALSE(gallery.trials[0].start.picture);
  EXPECT_EQ(gallery.left_out, 1u);
}

// WebP as libwebp begins it; the report reads only the size of the picture.
std::string webp_of(unsigned width, unsigned height, std::size_t bytes, const std::string& content) {
  const auto little_endian = [](std::size_t value) {
    std::string text;
    for (int i = 0; i < 4; ++i) text += static_cast<char>(value >> 8 * i & 0xff);
    return text;
  };
  const std::string start =
      "WEBPVP8L" + little_endian(bytes) + '\x2f' + little_endian((width - 1) | (height - 1) << 14);
  std::string file = start + content;
  file.resize(bytes, '.');
  return "RIFF" + little_endian(bytes) + file;
}

// As many methods, levels, steps and pictures as the quick suite has, each picture with its usual size.
TEST_F(Pictures, PageOfAQuickSuiteIsUnderSevenHundredKilobytes) {
  std::vector<records::TrialRecord> trials;
  for (const char* level : {"rho0", "rho0.25", "rho0.5"})
    for (const char* method : {"imitation", "bo-gp", "nlopt-bobyqa", "random", "home"})
      for (std::uint64_t i = 0; i < 3; ++i) {
        std::vector<double> errors;
        for (int step = 0; step <= 30; ++step)
          errors.push_back(0.04 / (1 + step) + 1e-5 * std::sin(static_cast<double>(trials.size()) * step));
        trials.push_back(trial(method, i, errors, level));
      }
  write(trials);
  add_to_manifest({{"spec", {{"rmse", 0.02}}}});
  Json index = Json::array();
  for (const records::TrialRecord& one : trials) {
    put(one.trial + ".png", made_png(std::string(5500, '.') + one.trial));
    put(one.trial + ".webp", webp_of(640, 80, 4700, one.trial));
    const char* why = std::array{"best", "median", "worst"}.at(one.instance);
    Json shown = entry(one.algorithm, why, one.trial + ".png", one.trial + ".png");
    shown["noise_level"] = one.noise_level;
    Json frames = Json::array();
    for (int step = 0; step < 8; ++step)
      frames.push_back({{"step", step},
                        {"commanded_pose", std::vector<double>(5, 0.123456 * step)},
                        {"true_pose", std::vector<double>(5, 0.134567 * step)},
                        {"measured", 0.0234567},
                        {"commanded", 0.0123456},
                        {"recommended", 0.0123456},
                        {"machine_seconds", 0.123456 * step}});
    shown["film"] = {{"file", one.trial + ".webp"}, {"tile", 80}, {"frames", frames}};
    index.push_back(shown);
  }
  write_index(index);
  const Gallery gallery = load_gallery(folder_);
  EXPECT_TRUE(std::all_of(gallery.trials.begin(), gallery.trials.end(), [](const TrialPictures& one) {
    return one.film.picture.has_value();
  })) << "every film is embedded";
  EXPECT_LT(Report(folder_).html().size(), 700'000U);
}

TEST_F(Pictures, ToleratesADamagedIndex) {
  write({trial("x", 0, {0.1, 0.05})});
  for (const char* index : {"{", "[]", "{\"format\": 9}", "{\"format\": 1, \"trials\": [3, {\"frames\": [7]}]}"}) {
    put("index.json", index);
    std::string page;
    ASSERT_NO_THROW(page = Report(folder_).html()) << index;
    EXPECT_THAT(page, HasSubstr("<b>x</b> has the lowest error")) << index;
  }
  put("index.json", "{");
  EXPECT_THAT(Report(folder_).html(), HasSubstr("Pictures that could not be shown"));
}

}  // namespace
}  // namespace relign::report
