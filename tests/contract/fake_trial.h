// The fake trial of the conformance checks (core/harness/conformance), under the names that tests use.
#pragma once

#include "conformance/fake_trial.h"

namespace relign::test {

using conformance::bowl;
using conformance::FakeSetup;
using conformance::FakeTrial;
using conformance::Pose;

}  // namespace relign::test
