// Lets a test program be the child process of its checks: it starts much faster than relign-bench, which
// links everything. verb_test.cpp uses relign-bench itself.
#pragma once

#include <cstdlib>
#include <string>

#include "conformance/inspection.h"
#include "run_tests.h"

namespace relign::conformance {

inline const char* const kThisProgram = "/proc/self/exe";

inline int run_child_or_tests(int argc, char** argv) {
  // program plugin check --one CHECK --report FD PATH
  if (argc == 8 && std::string(argv[1]) == "plugin" && std::string(argv[3]) == "--one") {
    run_one_check(argv[7], argv[4], std::atoi(argv[6]));
    return 0;
  }
  return test::run_tests(argc, argv);
}

}  // namespace relign::conformance
