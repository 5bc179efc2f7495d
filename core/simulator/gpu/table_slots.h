// Which lens has which of the tables of importance regions in the memory of a GPU.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <unordered_map>
#include <vector>

namespace relign::gpu {

// A lens, for as long as it exists (imaging::MountedLens).
using LensIdentity = std::shared_ptr<const char>;

class TableSlots {
 public:
  struct Slot {
    std::int32_t table = 0;
    std::int32_t stamp = 0;  // above 0; other than that of any lens before
  };
  // The table of each lens. Lenses that had none get that of a lens that exists no more, a new one while there are
  // fewer than `most`, that which was not used for the longest time, or a new one if all are in use by this call.
  std::vector<Slot> take(const std::vector<LensIdentity>& lenses, std::size_t most);
  // No lens has a table now, and there are only `tables` of them.
  void forget(std::size_t tables);
  std::size_t count() const { return order_.size(); }

 private:
  struct Owned {
    Slot slot;
    std::weak_ptr<const char> lens;  // keeps the address of its identity from being used again
    const char* key = nullptr;       // null: none
    std::uint64_t used = 0;          // in which call
  };
  using Place = std::list<Owned>::iterator;
  Place use(Place owned);
  Place free_place(std::size_t most);

  std::list<Owned> order_;  // those not used for the longest time first
  std::unordered_map<const char*, Place> of_lens_;
  std::vector<Place> left_;  // by lenses that exist no more, found by this call
  std::int32_t stamps_ = 0;
  std::uint64_t calls_ = 0;
};

}  // namespace relign::gpu
