// For tests of the conformance checks: exports a second symbol.
#include "sound.h"

extern "C" RELIGN_EXPORT int helper_of_two_symbols();
extern "C" int helper_of_two_symbols() { return 7; }

RELIGN_PLUGIN(saboteur::Sound)
