#include "plugin_host/library_object.h"
#include "plugin_host/objects.h"
#include "plugin_host/process_plugin.h"

namespace relign::plugin_host {

struct NoiseLevel::Implementation {
  Implementation() = default;
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;
  virtual ~Implementation() = default;
  virtual std::string draw(std::uint64_t seed, const std::string& scene_description) = 0;

  class Library;
  class Process;
};

class NoiseLevel::Implementation::Library final : public Implementation {
 public:
  Library(const Choice& choice, const HostServices& services) : object_(choice, services, table(*choice.plugin)) {}

  std::string draw(std::uint64_t seed, const std::string& scene_description) override {
    const TextSink drawn;
    object_.demand("draw", "it returned no draw and no reason", [&] {
      return object_.table().draw(object_.get(), seed, {scene_description.data(), scene_description.size()},
                                  drawn.sink());
    });
    return drawn.text();
  }

 private:
  static const relign_noise_level_interface& table(const Manifest& manifest) {
    const auto& found = table_of<relign_noise_level_interface>(manifest, RELIGN_NOISE_LEVEL_INTERFACE);
    require_function(manifest, RELIGN_NOISE_LEVEL_INTERFACE, "draw", found.draw);
    return found;
  }

  LibraryObject<relign_noise_level_interface, relign_noise_level> object_;
};

class NoiseLevel::Implementation::Process final : public Implementation {
 public:
  Process(const Choice& choice, const HostServices& services) : plugin_(choice, services) {}

  std::string draw(std::uint64_t seed, const std::string& scene_description) override {
    const Json request = {{"message", "draw"}, {"seed", seed}, {"scene", parsed_json(scene_description)}};
    return plugin_.object(plugin_.ask(request, "drawn", "draw"), "drawn", "draw").dump();
  }

 private:
  ProcessPlugin plugin_;
};

NoiseLevel::NoiseLevel(const Choice& choice, const HostServices& services) {
  if (choice.plugin->command.empty())
    implementation_ = std::make_unique<Implementation::Library>(choice, services);
  else
    implementation_ = std::make_unique<Implementation::Process>(choice, services);
}

NoiseLevel::~NoiseLevel() = default;

std::string NoiseLevel::draw(std::uint64_t seed, const std::string& scene_description) {
  return implementation_->draw(seed, scene_description);
}

}  // namespace relign::plugin_host
