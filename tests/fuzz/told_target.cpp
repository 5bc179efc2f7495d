// What scenes and noise levels tell of themselves and draw, and offsets that an algorithm gives.
#include "base/json_source.h"
#include "target.h"
#include "trials/instance.h"
#include "trials/scene_facts.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const trials::SceneFacts toy = trials::read_scene_facts(R"({"name": "toy", "summary": "A scene.",
    "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1}, {"name": "Rx", "unit": "deg", "lower": -1, "upper": 1}],
    "nominal_pose": [0.5, 0.5], "image": {"width": 4, "height": 3, "white": 1}, "elements": ["L1", "L2"],
    "machine_time": {"speed_mm_per_s": 5, "speed_deg_per_s": 5, "settle_ms": 40, "exposure_ms": 15, "readout_ms": 30}})",
                                                                 "toy");
  const std::string text = fuzz::text_of(data, size);
  fuzz::accepted([&] {
    const trials::SceneFacts facts = trials::read_scene_facts(text, "made");
    fuzz::demand(!facts.axes.empty() && facts.nominal_pose.size() == facts.axes.size(), "a pose");
  });
  fuzz::accepted([&] {
    const trials::Perturbations drawn = trials::read_perturbations(text, toy, "level");
    fuzz::demand(drawn.start.size() == 2 && drawn.distortion.size() == 4, "whole perturbations");
    if (drawn.stage)
      fuzz::demand(drawn.stage->backlash.size() == 2 && drawn.stage->repeatability.size() == 2 &&
                       drawn.stage->encoder_step.size() == 2 && drawn.stage->drift.size() == 2 &&
                       drawn.stage->drift_seconds > 0,
                   "whole errors of the stage");
    if (drawn.batch)
      fuzz::demand(drawn.batch->size > 0 && drawn.batch->cure_shift.size() == 2 && drawn.batch->inspection.size() == 2,
                   "a whole batch");
  });
  fuzz::accepted([&] { trials::read_offsets(text, toy); });
  return 0;
}
