// The fake conversation of the conformance kit (core/plugin_check), under the names that tests use.
#pragma once

#include "plugin_check/fake_conversation.h"

namespace relign::test {

using plugin_check::bowl;
using plugin_check::FakeConversation;
using plugin_check::FakeSetup;
using plugin_check::Pose;

}  // namespace relign::test
