// How long a suite takes on this machine, from its scenes' parts timed now (trials/run_cost.h).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "cli/app.h"
#include "suites/suite.h"
#include "trials/scene_facts.h"

namespace relign::cli {

struct ExpectedTime {
  std::size_t trials = 0, frames = 0;
  unsigned workers = 1;
  std::optional<double> seconds;  // of all workers together; none: a hardware station sets the pace

  // "about 46 s on 2 cores (...)", with what is left out.
  std::string text() const;
};

// `facts`: of the suite's scenes, in order. Takes about as long as three steps of a trial on each scene. Moves no
// hardware. Throws Error.
ExpectedTime expected_time(Context& context, const suites::Suite& suite, const std::vector<trials::SceneFacts>& facts,
                           unsigned workers);

}  // namespace relign::cli
