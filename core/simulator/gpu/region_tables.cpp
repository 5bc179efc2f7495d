#include "gpu/region_tables.h"

#include <algorithm>

namespace relign::gpu {
namespace {

// Tables of lenses that no image needs now are kept up to this size, for the next batches.
constexpr std::size_t kKeptBytes = 1'000'000'000;
constexpr std::size_t kAtOnce = 16;  // tables are allocated so many at a time, or more
constexpr std::size_t kTableBytes = sizeof(optics::PassingRegion) + sizeof(std::int32_t);  // for each place

}  // namespace

RegionTables::RegionTables(const Gpu& gpu, std::int32_t places)
    : gpu_(&gpu), places_(static_cast<std::size_t>(places)) {}

void RegionTables::assign(const std::vector<LensIdentity>& lenses, std::vector<FitJob>& jobs) {
  const std::size_t most = kKeptBytes / (places_ * kTableBytes);
  const std::vector<TableSlots::Slot> slots = slots_.take(lenses, most);
  try {
    if (const std::size_t needed = slots_.count(); needed > tables_.size())
      allocate(std::max(needed, std::min(tables_.size() + kAtOnce, most)) - tables_.size());
  } catch (...) {
    forget();
    throw;
  }
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const Table& table = tables_[static_cast<std::size_t>(slots[i].table)];
    jobs[i].regions = table.regions;
    jobs[i].requested = table.requested;
    jobs[i].stamp = slots[i].stamp;
  }
}

void RegionTables::allocate(std::size_t tables) {
  auto regions = std::make_unique<Buffer>(*gpu_), requested = std::make_unique<Buffer>(*gpu_);
  regions->reserve(tables * places_ * sizeof(optics::PassingRegion));
  const std::vector<std::int32_t> none(tables * places_);  // no stamp
  requested->upload(none.data(), none.size() * sizeof none[0]);
  for (std::size_t i = 0; i < tables; ++i)
    tables_.push_back(
        {regions->as<optics::PassingRegion>() + i * places_, requested->as<std::int32_t>() + i * places_});
  memory_.push_back(std::move(regions));
  memory_.push_back(std::move(requested));
}

}  // namespace relign::gpu
