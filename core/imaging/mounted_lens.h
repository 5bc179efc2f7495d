// A lens as built, in front of a scene's sensor: what the camera needs of it from capture to capture.
#pragma once

#include <memory>
#include <mutex>

#include "imaging/scene_file.h"
#include "optics/assembly.h"
#include "optics/passing_table.h"

namespace relign::imaging {

// How the pupil of a scene's lens is found, for all places that its sensor can take.
optics::PupilSearch search_pupil(const SceneFile& scene);

class MountedLens {
 public:
  // `scene` outlives the lens. Costs nothing: what passes the lens is found out when a pose needs it.
  MountedLens(const SceneFile& scene, const optics::Assembly& assembly);
  // The perfect lens.
  explicit MountedLens(const SceneFile& scene);

  const optics::Assembly& assembly() const { return assembly_; }
  // Which directions can pass; filled under the mutex, and read by whoever held it since.
  optics::PassingTable& table() { return table_; }
  std::mutex& table_mutex() { return table_mutex_; }

 private:
  optics::Assembly assembly_;
  std::shared_ptr<const optics::PupilSearch> search_;
  optics::PassingTable table_;
  std::mutex table_mutex_;
};

}  // namespace relign::imaging
