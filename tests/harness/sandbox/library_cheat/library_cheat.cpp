#include <link.h>

#include <relign/plugin.hpp>
#include <stdexcept>
#include <string>

namespace {

int find_scene(dl_phdr_info* info, std::size_t, void* found) {
  const std::string path = info->dlpi_name ? info->dlpi_name : "";
  if (path.find("gaussian_spot.so") != std::string::npos) *static_cast<std::string*>(found) = path;
  return 0;
}

class LibraryCheat final : public relign::Optimizer {
 public:
  explicit LibraryCheat(const relign::Parameters&) {}
  void run(relign::Trial& trial) override {
    trial.first();
    std::string scene;
    ::dl_iterate_phdr(find_scene, &scene);
    throw std::runtime_error(scene.empty() ? "the scene's code is not in this process" : "it works: " + scene);
  }
};

}  // namespace

RELIGN_PLUGIN(LibraryCheat)
