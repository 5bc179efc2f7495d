// The pictures of a report, captured after the last trial: best, median and worst trial of every scene,
// noise level, protocol and algorithm, and each scene's reference image. Reports only embed them. Trials on a station
// cannot be repeated: their first and last captures are stored during the trial.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>

#include "images/image.h"
#include "records/record.h"
#include "runner/run.h"
#include "trials/trial.h"

namespace relign::runner {

struct PictureOptions {
  std::filesystem::path cache_folder;
  unsigned threads = 1;
  const std::atomic<bool>* stop = nullptr;
  std::function<void(const std::string&)> on_message;
  std::function<std::string(const plugin_host::Choice& scene)> draw_lens;  // as in RunOptions
};

std::string frame_name(unsigned step);  // file name of a picture

// First and last capture of a trial on a station.
class KeptCaptures {
 public:
  explicit KeptCaptures(const trials::SceneFacts& scene) : scene_(scene) {}
  void keep(const trials::Step& step, const float* pixels);
  // Writes them below pictures/, replacing those of an earlier attempt. Throws Error(io).
  void write(const std::filesystem::path& results, const std::string& trial) const;

 private:
  const trials::SceneFacts& scene_;
  images::Image first_, last_;
  unsigned last_step_ = 0;
};

// Writes pictures/ (index.json last) and scenes/<hash>/. Keeps existing frames, removes those of trials that are no
// longer shown. A scene that fails yields a message and no pictures. Throws Error(io) when the folder cannot be
// written.
void write_pictures(const PreparedPlan& prepared, const std::filesystem::path& results, const PictureOptions& options);

}  // namespace relign::runner
