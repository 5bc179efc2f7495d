// Writes videos with the program ffmpeg.
#pragma once

#include <filesystem>
#include <string>

namespace relign::cli {

// Throws Error(bad_input) with installation advice if ffmpeg is not on PATH.
void require_ffmpeg();

// `grey`: concatenated frames of width x height bytes. Throws Error(io) with ffmpeg's output if it fails.
void write_video(const std::filesystem::path& out, const std::string& grey, int width, int height,
                 double frames_per_second);

}  // namespace relign::cli
