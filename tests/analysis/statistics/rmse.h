// The score of scenes that compare images, for tests.
#pragma once

#include "base/scene_score.h"

namespace relign::statistics {
inline const SceneScore kRmse;
}  // namespace relign::statistics
