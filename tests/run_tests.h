// GoogleTest's main function, which also takes the source files whose tests shall run; without one it runs all.
#pragma once

namespace relign::test {

// The exit status. A file without a test in this program is an error.
int run_tests(int argc, char** argv);

}  // namespace relign::test
