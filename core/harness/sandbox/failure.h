// Ends the launcher with a message for the user, which becomes part of the message on the trial.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "plugin_host/confinement_status.h"

namespace relign::sandbox {

[[noreturn]] inline void refuse(const std::string& what, int code = errno) {
  std::fprintf(stderr, "sandbox: %s%s%s\n", what.c_str(), code ? ": " : "", code ? std::strerror(code) : "");
  ::_exit(plugin_host::kCannotConfine);
}

inline void require(bool done, const char* what) {
  if (!done) refuse(what);
}

}  // namespace relign::sandbox
