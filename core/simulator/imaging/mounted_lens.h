// A lens as built, in front of a scene's sensor: what the camera needs of it from capture to capture.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "imaging/scene_file.h"
#include "optics/assembly.h"
#include "optics/passing_table.h"

namespace relign::imaging {

// How the pupil of a scene's lens (at one of its wavelengths) is found, for all places that its sensor can take.
optics::PupilSearch search_pupil(const SceneFile& scene, const optics::Prescription& lens);

// The same lens as built at each of the scene's wavelengths; empty when it has but one.
std::vector<optics::Assembly> at_wavelengths(const SceneFile& scene, const optics::Assembly& assembly);

class MountedLens {
 public:
  // `scene` outlives the lens. Costs nothing: what passes the lens is found out when a pose needs it.
  MountedLens(const SceneFile& scene, const optics::Assembly& assembly);
  // The perfect lens.
  explicit MountedLens(const SceneFile& scene);

  // `which`: 0 is the lens at its own wavelength; a scene of several has them from 1 on, in its order.
  const optics::Assembly& assembly(std::size_t which = 0) const { return looks_[which]->assembly; }
  // Which directions can pass; filled under the mutex, and read by whoever held it since.
  optics::PassingTable& table(std::size_t which = 0) { return looks_[which]->table; }
  std::mutex& table_mutex() { return table_mutex_; }

 private:
  struct Look {
    Look(const optics::Assembly& of, std::shared_ptr<const optics::PupilSearch> how);
    optics::Assembly assembly;
    std::shared_ptr<const optics::PupilSearch> search;
    optics::PassingTable table;
  };
  std::vector<std::unique_ptr<Look>> looks_;
  std::mutex table_mutex_;
};

}  // namespace relign::imaging
