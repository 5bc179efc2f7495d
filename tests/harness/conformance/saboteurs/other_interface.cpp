// For tests of the conformance checks: built for another major version of the plugin interface.
#include "sound.h"

#undef RELIGN_ABI_MAJOR
#define RELIGN_ABI_MAJOR 77

RELIGN_PLUGIN(saboteur::Sound)
