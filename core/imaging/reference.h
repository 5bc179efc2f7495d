// O*: the noise-free reference images of a scene, cached on disk by content.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "imaging/camera.h"

namespace relign::imaging {

inline constexpr int kReferenceSamples = 1024;  // rays a pixel, for each of the two renders

// Everything the images of a scene depend on, as a hash: file contents enter, paths do not.
std::string scene_content_hash(const SceneFile& scene, const CaptureSettings& settings);

// Reads the reference from the cache folder, or renders it (perfect lens at the nominal pose) and
// stores it there (temporary file and rename). An unwritable or empty folder is no error; `warn` is
// told. A damaged cache file is rendered anew.
Reference make_reference(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel,
                         const std::filesystem::path& cache_folder,
                         const std::function<void(const std::string&)>& warn);

}  // namespace relign::imaging
