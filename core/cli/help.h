// The look of every --help. Our own, so that it is the same for every version of CLI11.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>

namespace relign::cli {

std::shared_ptr<CLI::FormatterBase> help_formatter();

}  // namespace relign::cli
