/*
 * relign/services/prior.h: "relign.prior/1", draws from the noise level's distribution. Needs RELIGN_OBSERVES_LEVEL.
 * The rules of all services are in relign/plugin.h.
 *
 * Draws use training seeds: they are never the instance of this trial or of any benchmark. A station does not offer it.
 */
#ifndef RELIGN_SERVICES_PRIOR_H
#define RELIGN_SERVICES_PRIOR_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SERVICE_PRIOR "relign.prior/1"
typedef struct relign_prior_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* Writes draw `number` of W, as relign_noise_level_interface::draw does. The same number is the same draw in every
   * trial of this level and scene. RELIGN_STOP; RELIGN_FAILED: the noise level failed. [run-thread] */
  relign_status (*draw)(void* context, uint64_t number, const relign_text_sink* drawn);
  /* Writes why the last service function of this trial failed. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_prior_service;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SERVICES_PRIOR_H */
