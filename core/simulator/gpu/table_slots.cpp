#include "gpu/table_slots.h"

namespace relign::gpu {

TableSlots::Place TableSlots::use(Place owned) {
  owned->used = calls_;
  order_.splice(order_.end(), order_, owned);
  return owned;
}

TableSlots::Place TableSlots::free_place(std::size_t most) {
  if (!left_.empty()) {
    const Place place = left_.back();
    left_.pop_back();
    return place;
  }
  if (order_.size() >= most && order_.front().used != calls_) {
    of_lens_.erase(order_.front().key);
    return order_.begin();
  }
  Owned made;
  made.slot.table = static_cast<std::int32_t>(order_.size());
  order_.push_front(made);
  return order_.begin();
}

std::vector<TableSlots::Slot> TableSlots::take(const std::vector<LensIdentity>& lenses, std::size_t most) {
  ++calls_;
  left_.clear();
  // First those that have a table, so that no other lens of this call takes it.
  bool has_new = false;
  for (const LensIdentity& lens : lenses)
    if (const auto found = of_lens_.find(lens.get()); found != of_lens_.end())
      use(found->second);
    else
      has_new = true;
  for (Place place = order_.begin(); has_new && place != order_.end(); ++place) {
    if (!place->lens.expired()) continue;
    of_lens_.erase(place->key);
    place->key = nullptr;
    left_.push_back(place);
  }
  std::vector<Slot> slots;
  for (const LensIdentity& lens : lenses) {
    auto found = of_lens_.find(lens.get());
    if (found == of_lens_.end()) {
      const Place place = free_place(most);
      place->slot.stamp = ++stamps_;
      place->lens = lens;
      place->key = lens.get();
      found = of_lens_.emplace(place->key, use(place)).first;
    }
    slots.push_back(found->second->slot);
  }
  return slots;
}

void TableSlots::forget(std::size_t tables) {
  of_lens_.clear();
  order_.remove_if([tables](const Owned& owned) { return static_cast<std::size_t>(owned.slot.table) >= tables; });
  for (Owned& owned : order_) {
    owned.lens.reset();
    owned.key = nullptr;
  }
}

}  // namespace relign::gpu
