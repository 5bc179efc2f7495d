#include "cli/spec_outlook.h"

#include "base/error.h"
#include "base/json_members.h"
#include "base/text.h"
#include "cli/interrupt.h"
#include "cli/progress.h"
#include "statistics/proportion.h"

namespace relign::cli {
namespace {

// What the lens as designed misses.
std::string missed_by(const trials::Reachable& design, const records::Specification& spec, const SceneScore& score) {
  std::vector<std::string> missed;
  if (design.field_mtf_deficit > 0)
    missed.push_back("the MTF of its worst field is " + significant(design.field_mtf_deficit, 2) + " below its limit");
  if (spec.mtf_centre > design.mtf.centre || spec.mtf_corner > design.mtf.corner)
    missed.push_back("MTF " + significant(design.mtf.centre, 2) + " in the centre and " +
                     significant(design.mtf.corner, 2) + " in the corner");
  if (design.score > spec.score) missed.push_back(score.name + " " + significant(design.score, 2) + score.suffix());
  return join(missed, ", ");
}

}  // namespace

SpecOutlook spec_outlook(Context& context, const LoadedScene& scene, const plugin_host::Choice& level,
                         const records::Specification& spec, std::uint64_t lenses) {
  SpecOutlook outlook;
  if (!trials::limits_reachable(spec)) return outlook;
  const std::atomic<bool>& stop = watch_for_stop();
  ProgressPrinter printer(context.progress_mode(), "lenses");
  runner::Progress progress;
  progress.doing = "best poses of lenses";
  progress.total = lenses;
  plugin_host::NoiseLevel drawing(level, context.services(1));
  outlook.yield = trials::possible_yield(*scene.scene, scene.facts, drawing, spec, lenses, [&](std::uint64_t done) {
    progress.done = done;
    printer.update(progress);
    if (stop) {
      printer.finish();
      throw Error(ErrorKind::stopped, "stopped after " + std::to_string(done) + " of " + counted(lenses, "lens"));
    }
  });
  printer.finish();
  const auto [possible, drawn] = std::pair{outlook.yield.possible, outlook.yield.lenses};
  if (drawn > 0) {
    const statistics::Band share = statistics::success_rate(possible, drawn);
    outlook.lenses = std::to_string(possible) + " of " + counted(drawn, "lens") + " (" +
                     fixed(100 * share.interval.low, 0) + " to " + fixed(100 * share.interval.high, 0) + " %)";
  }
  if (!outlook.yield.design.can_meet(spec))
    outlook.warning = "the lens as designed misses the specification at its best pose: " +
                      missed_by(outlook.yield.design, spec, scene.facts.score);
  else if (drawn > 0 && possible == 0)
    outlook.warning = "none of " + counted(drawn, "lens") + " drawn from " + level.id +
                      " can meet the specification, whatever the method";
  return outlook;
}

Json outlook_json(const SpecOutlook& outlook) {
  const trials::Reachable& design = outlook.yield.design;
  return {{"lenses", outlook.yield.lenses},
          {"possible", outlook.yield.possible},
          {"design",
           {{"score", number_or_null(design.score)}, {"field_mtf_deficit", number_or_null(design.field_mtf_deficit)}}}};
}

}  // namespace relign::cli
