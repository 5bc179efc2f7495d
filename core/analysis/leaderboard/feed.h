// The board as JSON, for other programs (docs/schemas/leaderboard.schema.json).
#pragma once

#include "leaderboard/board.h"

namespace relign::leaderboard {

inline constexpr const char* kFeedFormat = "relign-bench/leaderboard/1";

Json feed(const Board& board);

}  // namespace relign::leaderboard
