// relign/handle.hpp: what the tables of relign/border.hpp share: the objects behind the host's pointers, and the guard
// around every entry.
#ifndef RELIGN_HANDLE_HPP
#define RELIGN_HANDLE_HPP

#include <relign/plugin.h>

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <new>
#include <relign/basics.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace relign::border {

template <class Body>
relign_status guard(const relign_host* host, Body&& body) noexcept {
  try {
    return body();
  } catch (const Stopped&) {
    return RELIGN_STOP;
  } catch (const std::bad_alloc&) {
    host->fail(host->context, to_text("out of memory"));  // the host adds the limit that applies
  } catch (const std::exception& error) {
    host->fail(host->context, to_text(error.what()));
  } catch (...) {
    host->fail(host->context, to_text("an exception that is no std::exception"));
  }
  return RELIGN_FAILED;
}

template <class Object>
struct Handle {
  const relign_host* host;
  std::unique_ptr<Object> object;
};

template <class Object, class Raw>
Handle<Object>* handle(Raw* raw) {
  return reinterpret_cast<Handle<Object>*>(raw);
}

// A rectangle is four numbers in the interface.
inline std::vector<Region> to_regions(const std::uint32_t* values, std::uint32_t count) {
  std::vector<Region> regions(count);
  for (Region& region : regions) {
    region = {values[0], values[1], values[2], values[3]};
    values += 4;
  }
  return regions;
}

inline void check_count(const char* function, std::size_t found, std::size_t expected) {
  if (found != expected)
    throw std::logic_error(std::string(function) + " returned " + std::to_string(found) + " values; expected " +
                           std::to_string(expected));
}

}  // namespace relign::border

#endif  // RELIGN_HANDLE_HPP
