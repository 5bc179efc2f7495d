// Tables of importance regions in the memory of a GPU, which kernels fill as poses need them (tile_kernel.h).
#pragma once

#include <memory>
#include <vector>

#include "gpu/gpu.h"
#include "gpu/table_slots.h"
#include "gpu/tile_kernel.h"

namespace relign::gpu {

class RegionTables {
 public:
  // places: regions of a table.
  RegionTables(const Gpu& gpu, std::int32_t places);
  // Gives each job the table of its lens.
  void assign(const std::vector<LensIdentity>& lenses, std::vector<FitJob>& jobs);
  // What the tables contain may be incomplete, because a kernel did not run.
  void forget() { slots_.forget(tables_.size()); }

 private:
  void allocate(std::size_t tables);

  const Gpu* gpu_;
  std::size_t places_;
  TableSlots slots_;
  std::vector<std::unique_ptr<Buffer>> memory_;
  struct Table {
    optics::PassingRegion* regions;
    std::int32_t* requested;
  };
  std::vector<Table> tables_;
};

}  // namespace relign::gpu
