#include "policies/new_side_file.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/hash.h"
#include "policies/model.hpp"

namespace relign::policies {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

std::string content(const std::string& name) {
  std::ostringstream text;
  text << std::ifstream(fs::path(RELIGN_TEST_DATA) / "policies" / name, std::ios::binary).rdbuf();
  return text.str();
}

// tests/golden/policies/tiny.onnx takes two frames of 20 x 20 and returns two values.
class NewSideFile : public testing::Test {
 protected:
  std::string make(const std::string& bytes, std::vector<std::string> axes = {"x", "y"}, std::size_t side = 40) {
    pixels_.assign(side * side, 0.25F);
    const relign_image image = {sizeof(relign_image),
                                RELIGN_SAMPLE_FLOAT32,
                                static_cast<std::uint32_t>(side),
                                static_cast<std::uint32_t>(side),
                                1,
                                0,
                                pixels_.data(),
                                side * sizeof(float)};
    return new_side_file(bytes, sha256_hex(bytes), {"a_scene", std::move(axes), 0.5, ImageView(image)}, "a command");
  }
  std::string refusal(const std::string& bytes, const std::vector<std::string>& axes = {"x", "y"},
                      std::size_t side = 40) {
    try {
      make(bytes, axes, side);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  std::vector<float> pixels_;
};

TEST_F(NewSideFile, IsReadWithItsNetwork) {
  const std::string bytes = content("tiny.onnx");
  nlohmann::json about = nlohmann::json::parse(make(bytes));
  EXPECT_EQ(about["use"], "network");
  EXPECT_EQ(about["observation"]["size"], 20);
  EXPECT_EQ(about["observation"]["frames"], 2);
  EXPECT_EQ(about["parity"]["inputs"].size(), 64U);
  EXPECT_EQ(about["reference"]["means"], std::vector<double>(400, 0.25));
  EXPECT_EQ(make(bytes), make(bytes));

  const fs::path folder = fs::path(testing::TempDir()) / "relign_new_side_file";
  fs::create_directories(folder);
  std::ofstream(folder / "net.onnx", std::ios::binary) << bytes;
  const auto answer = [&] {
    std::ofstream(folder / "net.json") << about;
    Model model((folder / "net.onnx").string());
    std::vector<float> images(800,
                              51);  // axis 0 is the mean of the newest frame over 255, axis 1 half that of the other
    return model.answer(images);
  };
  EXPECT_NEAR(answer()[0], 0.2, 1e-6);
  EXPECT_NEAR(answer()[1], 0.1, 1e-6);
  // What the author fills in changes answers, and the parity set stays valid.
  about["observation"]["mean"] = 25.5;
  about["observation"]["deviation"] = 0.5;
  about["scales"] = {1, -10};
  fs::last_write_time(folder / "net.json", fs::file_time_type::clock::now() - std::chrono::hours(1));
  EXPECT_NEAR(answer()[0], 0.2, 1e-6);  // (51 - 25.5) / 0.5 = 51
  EXPECT_NEAR(answer()[1], -1, 1e-5);
  about["scales"] = {1};
  EXPECT_THROW(answer(), std::runtime_error);
  about["scales"] = {1, 1};
  about["observation"]["deviation"] = 0;
  EXPECT_THROW(answer(), std::runtime_error);
  fs::remove_all(folder);
}

TEST_F(NewSideFile, NamesWhatWasFoundAndWhatIsAllowed) {
  const std::string bytes = content("tiny.onnx");
  EXPECT_THAT(
      refusal(bytes, {"x", "y", "z"}),
      AllOf(HasSubstr("returns 2 values"), HasSubstr("one for each of the 3 axes of scene 'a_scene' (x, y, z)")));
  EXPECT_THAT(refusal(bytes, {"x", "y"}, 30),
              AllOf(HasSubstr("is 1 x 2 x 20 x 20, and captures of 30 x 30"), HasSubstr("a size that divides")));
  EXPECT_THAT(refusal("no network"), HasSubstr("not an ONNX network"));
  EXPECT_THAT(refusal(content("tiny-nan.onnx")), HasSubstr("not finite"));
  std::string operators = bytes;
  ASSERT_NE(operators.find("Flatten"), std::string::npos);
  // Names of values contain the word, too.
  for (std::size_t at = 0; (at = operators.find("Flatten", at)) != std::string::npos;)
    operators.replace(at, 7, "Reverse");
  EXPECT_THAT(refusal(operators),
              AllOf(HasSubstr("operator Reverse"), HasSubstr("is not one of the portable operators (Con"),
                    testing::EndsWith("Tanh); export a network without it")));
}

}  // namespace
}  // namespace relign::policies
