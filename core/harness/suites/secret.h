// Sealed suites: their instances are drawn from a secret, to which the suite holds a commitment (docs/sealed.md).
#pragma once

#include <string>

#include "suites/suite.h"

namespace relign::suites {

// 64 hex digits from the system's random numbers. Throws Error(io).
std::string new_secret();

bool is_commitment(const std::string& text);

// A secret as a file or a variable holds it, without white space around it. Throws Error(bad_input) that names `where`.
std::string read_secret(const std::string& text, const std::string& where);

// Throws Error(bad_input) that names `what` if the commitment is to another secret.
void check_secret(const std::string& secret, const std::string& commitment, const std::string& what);

// Draws the instances of a sealed suite from the secret. Throws Error(bad_input) when the suite is not sealed, or
// sealed with another secret.
void unseal(Suite& suite, const std::string& secret);

}  // namespace relign::suites
