// relign-library-host MANIFEST: an algorithm in a library as a process, so that a sandbox can hold it. Loads the one
// library and passes the messages of docs/process_plugins.md to it. Started by plugin_host/process_plugin.cpp.
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "base/error.h"
#include "base/fault.h"
#include "plugin_host/confinement.h"
#include "plugin_host/manifest.h"
#include "plugin_host/objects.h"
#include "sandbox/connection.h"
#include "sandbox/remote_trial.h"

namespace relign::sandbox {
namespace {

// Without "plugin 'x' failed in run: ", which the host adds itself.
std::string reason(const std::string& text, const std::string& plugin, const char* during) {
  const std::string before = "plugin '" + plugin + "' failed in " + during + ": ";
  return text.rfind(before, 0) == 0 ? text.substr(before.size()) : text;
}

class LibraryHost {
 public:
  explicit LibraryHost(const std::string& manifest)
      : manifest_(std::make_shared<plugin_host::Manifest>(plugin_host::read_manifest(manifest))) {}

  void serve() {
    while (true) {
      const Json message = connection_.receive();
      const std::string& name = message.at("message").get_ref<const std::string&>();
      if (name == "bye") return;
      if (name == "hello")
        connection_.send({{"message", "hello"}, {"protocol", 1}, {"id", manifest_->id}, {"needs", Json::array()}});
      else if (name == "create")
        answer("create", "created", [&] { create(message); });
      else if (name == "run")
        answer("run", "done", [&] { run(message); });
      else
        connection_.send({{"message", "failed"}, {"text", "unknown request '" + name + "'"}});
    }
  }

 private:
  template <class Body>
  void answer(const char* during, const char* done, Body&& body) {
    Json reply = {{"message", done}};
    try {
      body();
    } catch (const std::exception& error) {
      reply = {{"message", "failed"}, {"text", reason(fault_text(error), manifest_->id, during)}};
    }
    std::fflush(stdout);
    connection_.send(reply);
  }

  void create(const Json& message) {
    plugin_host::Choice choice;
    choice.plugin = manifest_;
    choice.id = manifest_->id;
    choice.parameters = message.at("parameters");
    plugin_host::HostServices services;
    services.threads = message.at("threads").get<unsigned>();
    services.log = [](int level, const std::string& text) {
      std::fprintf(stderr, "%s%s\n", std::string(plugin_host::log_prefix(level)).c_str(), text.c_str());
    };
    algorithm_ = std::make_unique<plugin_host::Algorithm>(choice, services);
  }

  void run(const Json& message) {
    if (!algorithm_) throw Error(ErrorKind::internal, "'run' came before 'create'");
    const RemoteTrial trial(connection_, message.at("task"));
    algorithm_->run(trial.table());
  }

  std::shared_ptr<plugin_host::Manifest> manifest_;
  Connection connection_;
  std::unique_ptr<plugin_host::Algorithm> algorithm_;
};

}  // namespace
}  // namespace relign::sandbox

int main(int count, char** words) {
  try {
    if (count != 2) throw relign::Error(relign::ErrorKind::bad_input, "usage: relign-library-host MANIFEST");
    relign::sandbox::LibraryHost(words[1]).serve();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", relign::fault_text(error).c_str());
    return 1;
  }
}
