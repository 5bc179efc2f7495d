// Films by the program ffmpeg: coding video is nothing to do oneself.
#pragma once

#include <filesystem>
#include <string>

namespace relign::cli {

// Throws Error(bad_input) that says what to install when there is no ffmpeg on PATH.
void require_film_program();

// `grey`: frames of width x height bytes, one behind the other. Throws Error(io) with ffmpeg's words when it fails.
void write_film(const std::filesystem::path& out, const std::string& grey, int width, int height,
                double frames_per_second);

}  // namespace relign::cli
