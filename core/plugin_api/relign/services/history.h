/*
 * relign/services/history.h: "relign.history/1": what inspection measured on earlier modules of the batch.
 * Needs RELIGN_OBSERVES_HISTORY. The rules of all services are in relign/plugin.h.
 *
 * The glue of modules from one batch cures alike: their shifts have a common mean, which a method can learn from the
 * modules before and aim off by it. Measured shifts are a function of the instances alone, whichever method aligned the
 * earlier modules and in whatever order trials ran.
 */
#ifndef RELIGN_SERVICES_HISTORY_H
#define RELIGN_SERVICES_HISTORY_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SERVICE_HISTORY "relign.history/1"
typedef struct relign_history_service {
  uint32_t struct_size;
  uint32_t modules; /* earlier modules of this batch; 0 for its first, on a station, and at a level without batches */
  void* context;
  /* Writes the measured shift of the module `back` places before this one, 1 to `modules`: the true pose after curing
   * minus that before, with the errors of inspection, `axes` fractions of the travel. RELIGN_BAD_ARGUMENT: another
   * module or number of axes; RELIGN_FAILED: the noise level failed; RELIGN_STOP. [run-thread] */
  relign_status (*cure_shift)(void* context, uint32_t back, double* shift, uint32_t axes);
  /* Writes why the last service function of this trial failed. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_history_service;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SERVICES_HISTORY_H */
