// What went wrong, as the user would read it.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "base/error.h"

namespace relign::test {

// The text of the Error that `body` throws; fails the test when it throws none or another kind.
template <class Body>
std::string error_text(ErrorKind kind, Body&& body) {
  try {
    body();
  } catch (const Error& error) {
    EXPECT_EQ(static_cast<int>(error.kind()), static_cast<int>(kind)) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

}  // namespace relign::test
