// A shared library opened at run time, and its functions.
#pragma once

#include <dlfcn.h>

#include <string>
#include <vector>

#include "base/error.h"

namespace relign::gpu {

class SharedLibrary {
 public:
  // The first of `names` that can be opened; of the one in the environment variable `chosen` alone, if it is set.
  SharedLibrary(const char* chosen, const std::vector<std::string>& names);
  // Libraries of NVIDIA start threads and must stay: never closed.
  bool is_open() const { return handle_ != nullptr; }
  const std::string& name() const { return name_; }
  const std::string& problem() const { return problem_; }  // why it is not open
  // Throws Error(bad_input) if the library has no such function.
  template <class Function>
  void find(Function*& function, const char* symbol) const {
    function = reinterpret_cast<Function*>(::dlsym(handle_, symbol));
    if (function == nullptr) throw Error(ErrorKind::bad_input, "'" + name_ + "' has no function '" + symbol + "'");
  }

 private:
  void* handle_ = nullptr;
  std::string name_, problem_;
};

}  // namespace relign::gpu
