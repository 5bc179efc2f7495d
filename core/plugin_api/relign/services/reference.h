/*
 * relign/services/reference.h: "relign.reference/1", the image to be reached. Needs RELIGN_OBSERVES_IMAGES. The
 * rules of all services are in relign/plugin.h.
 */
#ifndef RELIGN_SERVICES_REFERENCE_H
#define RELIGN_SERVICES_REFERENCE_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SERVICE_REFERENCE "relign.reference/1"
typedef struct relign_reference_service {
  uint32_t struct_size;
  uint32_t reserved;
  const relign_image* image; /* O*, of the size in relign_task */
} relign_reference_service;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SERVICES_REFERENCE_H */
