/*
 * relign/services/regions.h: "relign.regions/1": the next capture reads out only some regions of the image,
 * and takes only their readout time. Needs RELIGN_OBSERVES_IMAGES. The rules of all services are in relign/plugin.h.
 *
 * Inside the regions pixels are those of the whole frame, bit for bit; the others are 0. The merit of such a capture is
 * computed from its regions; it never counts as the best measured one.
 */
#ifndef RELIGN_SERVICES_REGIONS_H
#define RELIGN_SERVICES_REGIONS_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SERVICE_REGIONS "relign.regions/1"
typedef struct relign_regions_service {
  uint32_t struct_size;
  uint32_t most; /* how many regions select accepts */
  void* context;
  /* Selects `count` rectangles for the next capture of this trial; those after it are whole frames again. `regions` has
   * four values for each: first column, first row, columns, rows; at least one pixel, inside the image; they may
   * overlap. count 0 selects the whole frame. relign.run/1 starts with whole frames. RELIGN_UNSUPPORTED: the scene
   * captures whole frames only, and nothing is selected; RELIGN_BAD_ARGUMENT: no such rectangles. [run-thread] */
  relign_status (*select)(void* context, const uint32_t* regions, uint32_t count);
  /* Writes why the last service function of this trial failed. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_regions_service;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SERVICES_REGIONS_H */
