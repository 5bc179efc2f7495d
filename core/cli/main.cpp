#include "cli/app.h"

int main(int argc, char** argv) { return relign::cli::run_program(argc, argv); }
