/*
 * relign/services/measures.h: "relign.measures/1", measures of the last capture, such as its sharpness. Needs
 * RELIGN_OBSERVES_IMAGES. The rules of all services are in relign/plugin.h.
 */
#ifndef RELIGN_SERVICES_MEASURES_H
#define RELIGN_SERVICES_MEASURES_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SERVICE_MEASURES "relign.measures/1"
typedef struct relign_measures_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* Writes [{"name": "mtf", "summary": "...", "arguments": {"cycles_per_pixel": "...", ...}}, ...]; a summary states
   * the unit. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*list)(void* context, const relign_text_sink* measures);
  /* Writes one measure of the last capture. arguments_json: an object; empty text is "{}". The value is NaN when this
   * capture does not allow the measure (no light, no edge in the region); that is not a failure. RELIGN_BAD_ARGUMENT:
   * an unknown measure, or arguments that it does not take. [run-thread] */
  relign_status (*measure)(void* context, relign_text name, relign_text arguments_json, double* value);
  /* Writes why the last service function of this trial failed. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_measures_service;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SERVICES_MEASURES_H */
