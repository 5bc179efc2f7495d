// The baselines: methods that are added to every suite, because all others are compared with them.
#pragma once

#include <array>
#include <string>
#include <string_view>

namespace relign {

inline constexpr std::array kBaselines = {"home", "random"};  // ids of shipped optimizers

// The baseline for which a reader could take a method of this name, such as "Random" or " home_"; "" for other names.
std::string baseline_like(std::string_view name);

}  // namespace relign
