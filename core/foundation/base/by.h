// A value for each enumerator of an enum class that counts from 0.
#pragma once

#include <array>
#include <cstddef>

namespace relign {

template <class Enum, std::size_t count, class Value>
struct By {
  std::array<Value, count> values;
  Value& operator[](Enum key) { return values[static_cast<std::size_t>(key)]; }
  const Value& operator[](Enum key) const { return values[static_cast<std::size_t>(key)]; }
};

}  // namespace relign
