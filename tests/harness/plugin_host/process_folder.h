// A folder with plugins that run as processes: Python scripts, with relign_bench and without.
#pragma once

#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "plugin_host/objects.h"
#include "test_folder.h"

namespace relign::test {

class ProcessFolderTest : public FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    if (!runs("python3 -c 'import sys; sys.exit(sys.version_info < (3, 9))'"))
      GTEST_SKIP() << "python3 (3.9 or later) is not installed";
    ::setenv("XDG_CACHE_HOME", (folder_ / "cache").c_str(), 1);
    for (const char* patience : {"RELIGN_STOP_SECONDS", "RELIGN_HANDSHAKE_SECONDS", "RELIGN_CALL_SECONDS"})
      ::unsetenv(patience);
    services_.log = [this](int, const std::string& line) { logged_.push_back(line); };
  }

  static bool runs(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }

  // A plugin without relign_bench: `body` can use say(text), hear(), and begin(), which performs handshake and create
  // and returns the task of an algorithm.
  std::filesystem::path raw(const std::string& body, const std::string& kind = "optimizer") {
    write("raw/raw.py", std::string(kRaw) + body);
    write("raw/relign-plugin.json", R"({"id": "raw", "kind": ")" + kind +
                                        R"(", "summary": "Without relign_bench.", "command": ["python3", "raw.py"])" +
                                        (kind == "optimizer" ? R"(, "observes": ["merit", "box"]})" : "}"));
    return folder_ / "raw";
  }

  static plugin_host::Choice choice(plugin_host::Kind kind, const std::filesystem::path& plugin,
                                    const Json& parameters = {}) {
    return plugin_host::Catalog().resolve_or_throw(kind, plugin.string(), parameters);
  }

  static std::string indented(const std::string& text, std::size_t spaces) {
    std::string result;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) result += std::string(spaces, ' ') + line + "\n";
    return result;
  }

  plugin_host::HostServices services_;
  std::vector<std::string> logged_;

 private:
  static constexpr const char* kRaw = R"(
import json, os, sys, time
to_host = int(os.environ["RELIGN_TO_HOST_FD"])
from_host = os.fdopen(int(os.environ["RELIGN_FROM_HOST_FD"]), closefd=False)
def say(text): os.write(to_host, text.encode())
def hear(): return json.loads(from_host.readline())
def greet():
    hear(); say('{"message":"hello","protocol":1,"id":"raw","news":[]}\n')
    hear(); say('{"message":"created"}\n')
def begin():
    greet()
    return hear()["task"]
)";
};

}  // namespace relign::test
