// What a page calls the device of a scene and its captures: lenses and images, or devices and readings.
#pragma once

#include <string>

#include "base/json_source.h"
#include "base/scene_score.h"

namespace relign::report {

struct SceneWords {
  std::string device = "lens", devices = "lenses";
  std::string capture = "image";  // what ends every move: "image", "reading", or "capture", of both or of either
  std::string counted = "image";  // what axes and columns count from the start: images, or moves

  std::string a_capture() const { return (capture == "image" ? "an " : "a ") + capture; }
  std::string captures() const { return capture + "s"; }
  std::string counts() const { return counted + "s"; }
  // "69 images (the one at the start included)" or "68 moves": until so many moves after the start
  std::string until(std::size_t moves) const;
  // The name or title of a class of observations, or what a method observes, which has "images" for every capture:
  // "Methods that observe all readings"
  std::string observed(std::string text) const;
  bool operator==(const SceneWords&) const = default;
};

// By the description of a scene; of an absent one, as if it had images.
SceneWords words_of(const Json& description, const SceneScore& score);

// Of two scenes: neutral ones where they differ.
SceneWords common_words(const SceneWords& a, const SceneWords& b);

}  // namespace relign::report
