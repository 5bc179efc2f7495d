#include "target.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <new>
#include <typeinfo>

#include "base/error.h"
#include "base/text.h"

namespace relign::fuzz {
namespace fs = std::filesystem;

void demand(bool holds, const std::string& what) {
  if (holds) return;
  std::fprintf(stderr, "demanded: %s\n", what.c_str());
  std::abort();
}

bool accepted(const std::function<void()>& read) {
  try {
    read();
    return true;
  } catch (const Error& error) {
    const std::string text = error.what();
    demand(error.kind() != ErrorKind::internal, "no rule of ours is broken by an input, found: " + text);
    demand(!text.empty(), "an error with a sentence");
    demand(text == printable(text), "an error that a terminal can show, found: " + printable(text));
    demand(text.size() < 5 * kLongestError,
           "an error that a person can read, found bytes: " + std::to_string(text.size()));
    return false;
  } catch (const std::bad_alloc&) {
    demand(false, "no more memory than an input of this size may take");
  } catch (const std::exception& other) {
    demand(false,
           std::string("nothing but relign::Error escapes, found ") + typeid(other).name() + ": " + other.what());
  }
  return false;
}

const fs::path& scratch_folder() {
  struct Folder {
    Folder() {
      std::error_code code;
      const fs::path memory = "/dev/shm";
      path = (fs::is_directory(memory, code) ? memory : fs::temp_directory_path()) /
             ("relign-fuzz-" + std::to_string(::getpid()));
      fs::create_directories(path);
    }
    ~Folder() {
      std::error_code code;
      fs::remove_all(path, code);
    }
    fs::path path;
  };
  static const Folder folder;
  return folder.path;
}

void write_scratch(const fs::path& file, std::string_view content) {
  std::ofstream stream(file, std::ios::binary);
  stream.write(content.data(), static_cast<std::streamsize>(content.size()));
  demand(stream.good(), "room for " + file.string());
}

}  // namespace relign::fuzz
