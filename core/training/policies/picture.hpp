// Preprocessing of captures for a network.
#pragma once

#include <relign/basics.hpp>
#include <vector>

namespace relign::policies {

// Area-averages the image to rows x columns pixels, or, with rows 0, to as many rows as columns. Where width and height
// are multiples of these, each output is the mean of a block of whole pixels; otherwise pixels on a border are split by
// area.
std::vector<float> resampled(const ImageView& image, int columns, int rows = 0);

// Quantises to bytes in place, as in training: byte_whites * white and above become 255, negative values and NaN 0.
void to_bytes(std::vector<float>& picture, double white, double byte_whites);

// Root-mean-square difference of two images of the same size.
double rmse(const ImageView& one, const ImageView& other);

}  // namespace relign::policies
