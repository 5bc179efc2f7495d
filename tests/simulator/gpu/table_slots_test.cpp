// Which lens has which table: none is given away while its lens is in use, and regions of other lenses are never taken
// for a lens's own.
#include "gpu/table_slots.h"

#include <gtest/gtest.h>

#include <map>
#include <relign/random.hpp>

namespace relign::gpu::table_slots {
namespace {

LensIdentity lens() { return std::make_shared<const char>(); }

std::vector<int> tables(TableSlots& slots, const std::vector<LensIdentity>& lenses, std::size_t most) {
  std::vector<int> found;
  for (const TableSlots::Slot& slot : slots.take(lenses, most)) found.push_back(slot.table);
  return found;
}

TEST(TableSlots, KeepTheTablesOfLensesAndGiveAwayTheOldest) {
  TableSlots slots;
  const LensIdentity a = lens(), b = lens(), c = lens();
  EXPECT_EQ(tables(slots, {a, b, a}, 2), (std::vector<int>{0, 1, 0}));
  EXPECT_EQ(tables(slots, {b}, 2), std::vector<int>{1});
  EXPECT_EQ(tables(slots, {c}, 2), std::vector<int>{0}) << "that of a, which was not used for longer";
  EXPECT_EQ(tables(slots, {a, b, c}, 2), (std::vector<int>{2, 1, 0})) << "all are in use";
  EXPECT_EQ(slots.count(), 3U);
}

TEST(TableSlots, TakeThoseOfLensesThatExistNoMoreFirst) {
  TableSlots slots;
  const LensIdentity a = lens(), c = lens(), d = lens();
  LensIdentity b = lens();
  EXPECT_EQ(tables(slots, {a, b}, 9), (std::vector<int>{0, 1}));
  b.reset();
  EXPECT_EQ(tables(slots, {c}, 9), std::vector<int>{1});
  EXPECT_EQ(tables(slots, {d, a}, 9), (std::vector<int>{2, 0}));
}

TEST(TableSlots, ForgetLensesAndTables) {
  TableSlots slots;
  const LensIdentity a = lens(), b = lens();
  const std::vector<TableSlots::Slot> before = slots.take({a, b}, 9);
  slots.forget(1);
  EXPECT_EQ(slots.count(), 1U);
  const std::vector<TableSlots::Slot> after = slots.take({b, a}, 9);
  EXPECT_EQ(after[0].table, 0);
  EXPECT_EQ(after[1].table, 1);
  EXPECT_GT(std::min(after[0].stamp, after[1].stamp), std::max(before[0].stamp, before[1].stamp));
}

TEST(TableSlots, HoldWhatAnyCallsAskFor) {
  Random random(3);
  TableSlots slots;
  std::vector<LensIdentity> all(12);
  std::map<std::pair<int, int>, const char*> of_stamp;
  for (int call = 0; call < 1000; ++call) {
    for (LensIdentity& one : all)
      if (!one || random.uniform() < 0.1) one = lens();
    std::vector<LensIdentity> asked;
    for (int i = 0; i < 8; ++i)
      if (random.uniform() < 0.7) asked.push_back(all[static_cast<std::size_t>(random.uniform() * 12)]);
    if (random.uniform() < 0.02) slots.forget(slots.count() / 2);
    const std::vector<TableSlots::Slot> found = slots.take(asked, 9);
    std::map<int, const char*> now;
    for (std::size_t i = 0; i < asked.size(); ++i) {
      const char* const key = asked[i].get();
      ASSERT_EQ(now.emplace(found[i].table, key).first->second, key) << "two lenses in one table";
      ASSERT_LT(static_cast<std::size_t>(found[i].table), slots.count());
      const auto [held, is_new] = of_stamp.emplace(std::pair(found[i].table, found[i].stamp), key);
      ASSERT_EQ(held->second, key) << "regions of another lens";
    }
    ASSERT_LE(slots.count(), 9U);
  }
}

}  // namespace
}  // namespace relign::gpu::table_slots
