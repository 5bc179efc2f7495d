// The noise-free reference images O* of a scene, cached on disk by content.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "imaging/camera.h"

namespace relign::imaging {

// Rays per pixel of each of the two renders: 1024, fewer on large sensors, where averaging over pixels compensates the
// error of each.
int reference_samples(const SceneFile& scene);
// The same with a tracer, which is hundreds of times slower: a sixteenth.
int reference_samples(const SceneFile& scene, const optics::BlockTracer* tracer);

// Hash of everything that the images of a scene depend on: contents of files, not their paths.
std::string scene_content_hash(const SceneFile& scene, const CaptureSettings& settings);

// Where references are kept between runs. Empty folder: no cache.
struct ReferenceCache {
  std::filesystem::path folder;
  std::string renderer;  // hash of the rendering code and of a tracer's data: keeps their images apart
};

// Reads the reference from the cache, or renders it (perfect lens at the nominal pose) and stores it there (temporary
// file and rename). Calls `warn` if the folder is not writable. Renders again if a cache file is damaged.
Reference make_reference(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel,
                         const ReferenceCache& cache, const std::function<void(const std::string&)>& warn,
                         optics::BlockTracer* tracer = nullptr);

}  // namespace relign::imaging
