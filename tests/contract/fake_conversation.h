// The fake trial of the conformance checks (core/harness/conformance), under the names that tests use.
#pragma once

#include "conformance/fake_conversation.h"

namespace relign::test {

using conformance::bowl;
using conformance::FakeConversation;
using conformance::FakeSetup;
using conformance::Pose;

}  // namespace relign::test
