// Captures as a network sees them.
#pragma once

#include <relign/basics.hpp>
#include <vector>

namespace relign::policies {

// columns x columns means over equal parts of the image, which share the pixels on their borders by area: each part is
// a block of whole pixels where the image's width and height are multiples of `columns`.
std::vector<float> resampled(const ImageView& image, int columns);

// Rounded to bytes, as training does: 255 is `byte_whites` times `white` and all above; what is not finite is 0.
void to_bytes(std::vector<float>& picture, double white, double byte_whites);

// Root of the mean squared difference of two images of one size.
double rmse(const ImageView& one, const ImageView& other);

}  // namespace relign::policies
