// What a plugin's process sends: an algorithm's through a whole trial, a scene's, a noise level's. Corpus files hold
// all messages of a process, from its handshake to its end. Requests for services are read without a process besides,
// many times as fast.
#include <sys/mman.h>

#include <optional>

#include "conformance/fake_trial.h"
#include "plugin_host/objects.h"
#include "plugin_host/process_algorithm.h"
#include "plugin_host/process_services.h"
#include "target.h"

using namespace relign;
using namespace relign::plugin_host;

namespace {

relign_status write_text(const relign_text_sink* sink, const char* text) {
  sink->write(sink->context, {text, std::char_traits<char>::length(text)});
  return RELIGN_OK;
}

// Measures that answer anything, so that requests are followed to their ends.
const relign_measures_service* measures() {
  static const relign_measures_service service = [] {
    relign_measures_service made{};
    made.struct_size = sizeof made;
    made.list = [](void*, const relign_text_sink* sink) { return write_text(sink, "[{\"name\": \"mtf\"}]"); };
    made.measure = [](void*, relign_text name, relign_text, double* value) -> relign_status {
      *value = 0.5;
      return name.size > 3 ? RELIGN_BAD_ARGUMENT : RELIGN_OK;
    };
    return made;
  }();
  return &service;
}

conformance::FakeSetup setup() {
  conformance::FakeSetup made;
  made.axes = 2;
  made.budget = 3;
  made.observes = RELIGN_OBSERVES_MERIT | RELIGN_OBSERVES_BOX | RELIGN_OBSERVES_IMAGES;
  made.merit = [](const conformance::Pose&, std::uint32_t) { return 0.5; };
  made.service = [](std::string_view id) -> const void* {
    return id == RELIGN_SERVICE_MEASURES ? measures() : nullptr;
  };
  made.why = [] { return "no such measure"; };
  return made;
}

Choice choice(Kind kind, const std::filesystem::path& said) {
  auto manifest = std::make_shared<Manifest>();
  manifest->id = "made";
  manifest->kind = kind;
  manifest->command = {RELIGN_SAY, said.string()};
  manifest->folder = manifest->source = fuzz::scratch_folder();
  manifest->text = R"({"kind": "optimizer", "parameters": {}})";
  Choice made;
  made.plugin = manifest;
  made.id = "made";
  made.parameters = Json::object();
  return made;
}

void ask_services(const std::string& text) {
  SharedPixels pixels(::memfd_create("pixels", MFD_CLOEXEC));
  conformance::FakeTrial trial(setup());
  ProcessServices services(trial.handle(), pixels, 256);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    if (const Json request = parsed_json(text.substr(at, end - at)); request.is_object())
      fuzz::accepted([&] { fuzz::demand(services.answer(request).contains("message"), "an answer"); });
    at = end + 1;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  ask_services(text);
  const std::filesystem::path said = fuzz::scratch_folder() / "said";
  fuzz::write_scratch(said, text);
  HostServices services;
  services.log = [](auto&&...) {};
  const bool of_scene = text.find("described") != std::string::npos, of_level = text.find("drawn") != std::string::npos;
  fuzz::accepted([&] {
    if (of_scene) {
      Scene scene(choice(Kind::scene, said), services);
      scene.describe();
      scene.reference();
      scene.mount("{}");
    } else if (of_level) {
      NoiseLevel(choice(Kind::noise_level, said), services).draw(1, "{}");
    } else {
      conformance::FakeTrial trial(setup());
      ProcessAlgorithm(choice(Kind::optimizer, said), services).run(trial.handle());
    }
  });
  return 0;
}
