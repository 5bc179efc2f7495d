#include "described_schema.h"
#include "runner/frozen_plan.h"

namespace relign::runner {
namespace {

TEST(PlanDocuments, TheSchemaOfPlansHasTheirMembers) {
  approve_schema<FrozenPlan>("plan", "relign-bench plan",
                             "What plan writes: the frozen list of a suite's trials. docs/clusters.md");
}

}  // namespace
}  // namespace relign::runner
