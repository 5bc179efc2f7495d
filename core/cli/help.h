// Formats every --help. Not CLI11's formatter, so that the text is the same for every version of CLI11.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <memory>
#include <string>

namespace relign::cli {

std::shared_ptr<CLI::FormatterBase> help_formatter();

// The words of `text` in lines of a help's width; lines after the first begin with `indent` spaces.
std::string wrapped(const std::string& text, std::size_t indent);

// Adds a line of a help's list, or several: a name, and what it is.
void add_row(std::string& text, const std::string& left, const std::string& right);

}  // namespace relign::cli
