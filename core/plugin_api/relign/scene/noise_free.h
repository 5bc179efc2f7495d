/*
 * relign/scene/noise_free.h: optional ability of a scene: a noise-free image, for pictures and reports.
 */
#ifndef RELIGN_SCENE_NOISE_FREE_H
#define RELIGN_SCENE_NOISE_FREE_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SCENE_NOISE_FREE "relign.scene.noise-free/1"
typedef struct relign_scene_noise_free {
  uint32_t struct_size;
  uint32_t reserved;
  /* Writes the image at a true pose (`axes` values) into `pixels` (of the caller). RELIGN_UNSUPPORTED: not for this
   * scene; RELIGN_FAILED. [object-thread] */
  relign_status (*render)(relign_assembly* assembly, const double* true_pose, uint32_t axes, float* pixels);
} relign_scene_noise_free;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SCENE_NOISE_FREE_H */
