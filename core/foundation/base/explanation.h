// What a code that the program prints or returns means to its user: the entries of `relign-bench explain`.
#pragma once

#include <string_view>

namespace relign {

struct Explanation {
  std::string_view code;     // as printed; for a family such as crashed(SIGSEGV), what its members begin with
  std::string_view meaning;  // a clause
  std::string_view causes;   // usual ones; empty: nothing went wrong
  std::string_view next;     // what to do; empty: nothing
};

}  // namespace relign
