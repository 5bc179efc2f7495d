// Formats every --help. Not CLI11's formatter, so that the text is the same for every version of CLI11.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>

namespace relign::cli {

std::shared_ptr<CLI::FormatterBase> help_formatter();

}  // namespace relign::cli
