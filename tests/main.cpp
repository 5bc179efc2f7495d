// The main function of test programs, except for those that bring their own.
#include "run_tests.h"

int main(int argc, char** argv) { return relign::test::run_tests(argc, argv); }
