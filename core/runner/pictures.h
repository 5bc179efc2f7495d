// The pictures a report shows, taken after the last trial: best, median and worst trial of every scene,
// noise level, protocol and algorithm, and each scene's reference. Reports only embed them.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>

#include "runner/run.h"

namespace relign::runner {

struct PictureOptions {
  std::filesystem::path cache_folder;
  unsigned threads = 1;
  const std::atomic<bool>* stop = nullptr;
  std::function<void(const std::string&)> on_message;
};

// Writes pictures/ (index.json last) and scenes/<hash>/. Frames that are there already stay, those of
// trials that are no longer shown go. A scene that fails costs its pictures and a message. Throws
// Error(io) when the folder cannot be written.
void write_pictures(const PreparedPlan& prepared, const std::filesystem::path& results, const PictureOptions& options);

}  // namespace relign::runner
