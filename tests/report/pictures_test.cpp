#include "report/pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "report/made_results.h"
#include "report/report.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// A 2 x 2 checkerboard; bytes after its end make another file of the same picture.
std::string png(const std::string& tail = "") {
  static const unsigned char kBytes[] = {
      0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00,
      0x00, 0x02, 0x00, 0x00, 0x00, 0x02, 0x08, 0x00, 0x00, 0x00, 0x00, 0x57, 0xdd, 0x52, 0xf8, 0x00, 0x00, 0x00,
      0x0c, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x60, 0xf8, 0x0f, 0x84, 0x00, 0x06, 0x00, 0x01, 0xff, 0xad,
      0x2c, 0x37, 0x25, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
  return std::string(reinterpret_cast<const char*>(kBytes), sizeof kBytes) + tail;
}

class Pictures : public MadeResults {
 protected:
  void write_index(const Json& trials, const Json& references = Json::array()) {
    write_file_atomically(folder_ / "pictures" / "index.json",
                          Json{{"format", 1}, {"trials", trials}, {"references", references}}.dump());
  }
  static Json entry(const std::string& algorithm, const std::string& why, const std::string& start,
                    const std::string& end) {
    return {{"trial", algorithm + why},
            {"scene", "relign_od"},
            {"noise_level", "rho0"},
            {"protocol", "paper"},
            {"algorithm", algorithm},
            {"instance", 1},
            {"why", why},
            {"frames", {{{"step", 0}, {"file", start}}, {{"step", 9}, {"file", end}}}}};
  }
  void put(const std::string& file, const std::string& bytes) {
    write_file_atomically(folder_ / "pictures" / file, bytes);
  }
};

TEST_F(Pictures, EqualPicturesAreEmbeddedOnce) {
  put("a.png", png());
  put("b.png", png());
  put("c.png", png("other"));
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

// A folder from a stranger must not carry this machine's files into a page that is passed on.
TEST_F(Pictures, NothingOutsideThePicturesFolderIsRead) {
  write_file_atomically(folder_ / "secret.png", png());
  put("inside.png", png("inside"));
  fs::create_symlink(folder_ / "secret.png", folder_ / "pictures" / "link.png");
  write_index({entry("x", "best", "../secret.png", (folder_ / "secret.png").string()),
               entry("y", "best", "link.png", "./deep/../inside.png")});
  const Gallery gallery = load_gallery(folder_);
  EXPECT_FALSE(gallery.trials[0].start.picture);
  EXPECT_FALSE(gallery.trials[0].end.picture);
  EXPECT_FALSE(gallery.trials[1].start.picture) << "a link out of the folder";
  EXPECT_TRUE(gallery.trials[1].end.picture);
  EXPECT_EQ(gallery.problems.size(), 3u);
}

TEST_F(Pictures, OnlyPngIsEmbedded) {
  put("page.png", "<svg onload=alert(1)>");
  put("short.png", png().substr(0, 20));
  write_index({entry("x", "best", "page.png", "short.png"), entry("y", "best", "missing.png", "missing.png")});
  const Gallery gallery = load_gallery(folder_);
  EXPECT_TRUE(gallery.pictures.empty());
  EXPECT_THAT(gallery.problems,
              ElementsAre(HasSubstr("short.png: this is no PNG"), HasSubstr("missing.png: no such picture"),
                          HasSubstr("page.png: this is no PNG")));
}

TEST_F(Pictures, OverTheLimitTheMedianTrialGoesFirst) {
  for (const char* name : {"best", "median", "worst"}) put(std::string(name) + ".png", png(name));
  write_index({entry("x", "best", "best.png", "best.png"), entry("x", "median", "median.png", "median.png"),
               entry("x", "worst", "worst.png", "worst.png")});
  const std::size_t one = load_gallery(folder_).pictures[0].data_uri.size();
  const Gallery gallery = load_gallery(folder_, one);
  EXPECT_FALSE(gallery.trials[0].end.picture);
  EXPECT_TRUE(gallery.trials[1].end.picture);
  EXPECT_FALSE(gallery.trials[2].end.picture);
  EXPECT_EQ(gallery.left_out, 2u);
}

TEST_F(Pictures, ADamagedIndexCostsThePicturesOnly) {
  write({trial("x", 0, {0.1, 0.05})});
  for (const char* index : {"{", "[]", "{\"format\": 9}", "{\"format\": 1, \"trials\": [3, {\"frames\": [7]}]}"}) {
    put("index.json", index);
    std::string page;
    ASSERT_NO_THROW(page = Report(folder_).html()) << index;
    EXPECT_THAT(page, HasSubstr("<b>x</b> ends with the lowest error")) << index;
  }
  put("index.json", "{");
  EXPECT_THAT(Report(folder_).html(), HasSubstr("Pictures that could not be shown"));
}

}  // namespace
}  // namespace relign::report
