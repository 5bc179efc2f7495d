#include <type_traits>

#include "plugin_host/guard.h"
#include "plugin_host/library.h"
#include "plugin_host/objects.h"

namespace relign::plugin_host {

struct NoiseLevel::Implementation {
  Implementation(const Choice& choice, const HostServices& services)
      : manifest(choice.plugin), host(*choice.plugin, services) {}

  std::shared_ptr<const Manifest> manifest;
  ObjectHost host;
  const relign_noise_level_interface* table = nullptr;
  relign_noise_level* object = nullptr;
};

NoiseLevel::NoiseLevel(const Choice& choice, const HostServices& services)
    : implementation_(std::make_unique<Implementation>(choice, services)) {
  Implementation& mine = *implementation_;
  const auto* table = static_cast<const relign_noise_level_interface*>(plugin_interface(
      *mine.manifest, RELIGN_NOISE_LEVEL_INTERFACE,
      offsetof(relign_noise_level_interface, destroy) + sizeof(relign_noise_level_interface::destroy)));
  require_function(*mine.manifest, RELIGN_NOISE_LEVEL_INTERFACE, "create", table->create);
  require_function(*mine.manifest, RELIGN_NOISE_LEVEL_INTERFACE, "draw", table->draw);
  require_function(*mine.manifest, RELIGN_NOISE_LEVEL_INTERFACE, "destroy", table->destroy);
  mine.table = table;
  const ParameterTable parameters(choice);
  const relign_status status = mine.host.call("create", [&](const FloatingPointState&) {
    return table->create(mine.host.host(), parameters.table(), &mine.object);
  });
  if (status != RELIGN_OK || !mine.object) mine.host.throw_failure("create", "it made no object and gives no reason");
}

NoiseLevel::~NoiseLevel() {
  Implementation& mine = *implementation_;
  if (!mine.object) return;
  const FloatingPointGuard guard(mine.host.plugin_id());
  try {
    mine.table->destroy(mine.object);
  } catch (...) {  // a destructor has nobody to tell
  }
}

std::string NoiseLevel::draw(std::uint64_t seed, const std::string& scene_description) {
  Implementation& mine = *implementation_;
  const TextSink drawn;
  const relign_status status = mine.host.call("draw", [&](const FloatingPointState&) {
    return mine.table->draw(mine.object, seed, {scene_description.data(), scene_description.size()}, drawn.sink());
  });
  if (status != RELIGN_OK) mine.host.throw_failure("draw", "it drew nothing and gives no reason");
  return drawn.text();
}

}  // namespace relign::plugin_host
