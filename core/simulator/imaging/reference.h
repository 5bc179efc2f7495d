// O*: the noise-free reference images of a scene, cached on disk by content.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "imaging/camera.h"

namespace relign::imaging {

// Rays a pixel, for each of the two renders: 1024, and fewer on large sensors, where the mean over pixels makes up
// for each pixel's own error.
int reference_samples(const SceneFile& scene);
// The same with a tracer, which takes hundreds of times as long: a sixteenth.
int reference_samples(const SceneFile& scene, const optics::BlockTracer* tracer);

// Everything the images of a scene depend on, as a hash: file contents enter, paths do not.
std::string scene_content_hash(const SceneFile& scene, const CaptureSettings& settings);

// Where references are kept between runs. Empty folder: nowhere.
struct ReferenceCache {
  std::filesystem::path folder;
  std::string renderer;  // hash of the code that renders, and of a tracer's data: others never find this one's images
};

// Reads the reference from the cache, or renders it (perfect lens at the nominal pose) and stores it
// there (temporary file and rename). An unwritable folder is no error; `warn` is told. A damaged
// cache file is rendered anew.
Reference make_reference(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel,
                         const ReferenceCache& cache, const std::function<void(const std::string&)>& warn,
                         optics::BlockTracer* tracer = nullptr);

}  // namespace relign::imaging
