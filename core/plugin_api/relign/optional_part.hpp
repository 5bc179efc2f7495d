// Functions of a shared library that an installation may lack, because what it needs is large.
//
// What it is for: parts of relign-bench that few need. They are in lib/relign-bench/parts of the build folder or
// installation that the calling library or the program belongs to.
#ifndef RELIGN_OPTIONAL_PART_HPP
#define RELIGN_OPTIONAL_PART_HPP

#include <dlfcn.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace relign {

namespace detail {
// The part as a file, or an empty path.
inline std::filesystem::path part_near(const std::filesystem::path& library, const std::string& name) {
  namespace fs = std::filesystem;
  std::error_code code;
  fs::path folder = fs::weakly_canonical(library, code).parent_path();
  for (int up = 0; up < 3 && !folder.empty(); ++up, folder = folder.parent_path())
    for (const char* place : {"parts", "lib/relign-bench/parts"})
      if (fs::path file = folder / place / (name + ".so"); fs::is_regular_file(file, code)) return file;
  return {};
}
}  // namespace detail

// The function `symbol` of part `name`. Throws std::runtime_error with the reason.
template <typename Function>
Function* function_of_part(const std::string& name, const char* symbol) {
  Dl_info here = {};
  ::dladdr(reinterpret_cast<const void*>(&function_of_part<Function>), &here);
  std::filesystem::path file;
  if (here.dli_fname) file = detail::part_near(here.dli_fname, name);
  if (file.empty()) file = detail::part_near("/proc/self/exe", name);
  if (file.empty()) throw std::runtime_error("this installation lacks the optional part '" + name + "'");
  void* const library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const found = library ? ::dlsym(library, symbol) : nullptr;
  if (!found) throw std::runtime_error(::dlerror());
  return reinterpret_cast<Function*>(found);
}

}  // namespace relign

#endif  // RELIGN_OPTIONAL_PART_HPP
