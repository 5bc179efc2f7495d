#include "report/scene_words.h"

#include "base/json_members.h"
#include "base/text.h"

namespace relign::report {
namespace {

constexpr const char* kNeutral = "capture";

void set_capture(SceneWords& words, const std::string& capture) {
  words.capture = capture;
  words.counted = capture == "image" ? "image" : "move";
}

}  // namespace

std::string SceneWords::until(std::size_t moves) const {
  if (counted == "move") return relign::counted(moves, counted);
  // Step 0 is an image, too.
  return relign::counted(moves + 1, counted) +
         (moves > 0 ? " (the one at the start included)" : " (the one at the start)");
}

std::string SceneWords::observed(std::string text) const {
  const std::string images = "images";
  if (const std::size_t at = text.find(images); at != std::string::npos)
    text.replace(at, images.size(), capture == "reading" ? "all readings" : captures());
  return text;
}

SceneWords words_of(const Json& description, const SceneScore& score) {
  SceneWords words;
  if (!score.squared) words.device = "device", words.devices = "devices";
  if (!list_of(description, "readings").empty())
    set_capture(words, object_of(description, "image").empty() ? "reading" : kNeutral);
  return words;
}

SceneWords common_words(const SceneWords& a, const SceneWords& b) {
  SceneWords words = a;
  if (a.device != b.device) words.device = "device", words.devices = "devices";
  if (a.capture != b.capture) set_capture(words, kNeutral);
  return words;
}

}  // namespace relign::report
