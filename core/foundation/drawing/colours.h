// Colours of pictures.
#pragma once

#include <cstddef>

#include "drawing/canvas.h"

namespace relign::drawing {

inline constexpr Colour kInk{34, 40, 49};
inline constexpr Colour kQuietInk{96, 104, 116};
inline constexpr Colour kWhite{255, 255, 255};

// Okabe and Ito's colours, distinguishable with colour blindness, without their yellow, which is too pale on white.
// Repeats after the last.
Colour series_colour(std::size_t number);

// viridis (Smith and van der Walt, CC0): perceptually uniform, also in grey and with colour blindness. share: 0 (dark)
// to 1 (bright), clipped.
Colour map_colour(double share);

}  // namespace relign::drawing
