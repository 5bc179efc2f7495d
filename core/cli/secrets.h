// --secret and RELIGN_SECRET: the secret of a sealed suite (docs/sealed.md).
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "suites/suite.h"

namespace relign::cli {

void add_secret_option(CLI::App& verb, std::string& file);

// The secret in the file, or in the variable if no file is given. Removes the variable, so that no plugin inherits it.
// Throws Error(io), Error(bad_input).
std::optional<std::string> given_secret(const std::string& file);

// What to do without a secret, for an error about `what`.
std::string missing_secret(const std::string& what);

// Unseals a sealed suite. Throws Error(bad_input) without its secret, or for a file given to a suite that needs none.
void unseal_suite(suites::Suite& suite, const std::string& file);

}  // namespace relign::cli
