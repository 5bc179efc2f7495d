// The text with which bad input is refused.
#pragma once

#include <string>

#include "error_text.h"

namespace relign::submissions {

template <class Body>
std::string refusal(Body&& body) {
  return test::error_text(ErrorKind::bad_input, body);
}

}  // namespace relign::submissions
