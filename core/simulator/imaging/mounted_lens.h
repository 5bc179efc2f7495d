// A lens as built in front of a scene's sensor: the state that the camera keeps between captures.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "imaging/scene_file.h"
#include "optics/assembly.h"
#include "optics/passing_table.h"

namespace relign::imaging {

// The pupil search of a scene's lens (at one of its wavelengths), for all positions that the sensor can take.
optics::PupilSearch search_pupil(const SceneFile& scene, const optics::Prescription& lens);

// The same lens as built at each of the scene's wavelengths; empty if it has only one.
std::vector<optics::Assembly> at_wavelengths(const SceneFile& scene, const optics::Assembly& assembly);

class MountedLens {
 public:
  // `scene` must outlive the lens. Cheap: importance regions are computed when a pose needs them.
  MountedLens(const SceneFile& scene, const optics::Assembly& assembly);
  // The perfect lens.
  explicit MountedLens(const SceneFile& scene);

  // For what others keep about it: expires with it.
  const std::shared_ptr<const char>& identity() const { return identity_; }
  // Whether its first image was checked (certificate.h).
  bool is_certified() const { return certified_; }
  void set_certified() { certified_ = true; }

  // `which`: 0 is the lens at its own wavelength; 1 and up are those of a scene with several, in its order.
  const optics::Assembly& assembly(std::size_t which = 0) const { return at_wavelengths_[which]->assembly; }
  // The importance regions. Filled under the mutex; threads that have held it since may read them.
  optics::PassingTable& table(std::size_t which = 0) { return at_wavelengths_[which]->table; }
  std::mutex& table_mutex() { return table_mutex_; }

 private:
  struct AtWavelength {
    AtWavelength(const optics::Assembly& of, std::shared_ptr<const optics::PupilSearch> how);
    optics::Assembly assembly;
    std::shared_ptr<const optics::PupilSearch> search;
    optics::PassingTable table;
  };
  std::shared_ptr<const char> identity_ = std::make_shared<const char>();
  bool certified_ = false;
  std::vector<std::unique_ptr<AtWavelength>> at_wavelengths_;
  std::mutex table_mutex_;
};

}  // namespace relign::imaging
