// Writes videos with the program ffmpeg.
#pragma once

#include <filesystem>
#include <string>

namespace relign::drawing {

// Throws Error(bad_input) with installation advice if ffmpeg, which `option` requires, is not on PATH.
void require_ffmpeg(const std::string& option);

// `grey`: concatenated frames of width x height bytes. Throws Error(io) with ffmpeg's output if it fails.
void write_video(const std::filesystem::path& out, const std::string& grey, int width, int height,
                 double frames_per_second);

}  // namespace relign::drawing
