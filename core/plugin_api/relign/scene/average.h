/*
 * relign/scene/average.h: optional ability of a scene: a noise-free image with its remaining noise stated. A
 * scene whose relign_scene_noise_free is exact does not need it.
 */
#ifndef RELIGN_SCENE_AVERAGE_H
#define RELIGN_SCENE_AVERAGE_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SCENE_AVERAGE "relign.scene.average/1"
typedef struct relign_average {
  uint32_t struct_size;
  uint32_t reserved;
  double standard_error; /* of a pixel: the root mean square over all pixels; finite, 0 or more */
  uint64_t samples;      /* rays (or what the scene averages) per pixel that were used */
} relign_average;

typedef struct relign_scene_average {
  uint32_t struct_size;
  uint32_t reserved;
  /* Averages until the standard error of a pixel is at most `error` (positive, in pixel values), or until a bound of
   * the scene's own; if `samples` is above 0, instead that many samples per pixel (rounded up by the scene). Writes
   * `pixels` (of the caller) and what was reached, which may be more than `error`. A pure function of assembly, pose,
   * seed, error and samples; other seeds give independent images. RELIGN_UNSUPPORTED: not for this scene;
   * RELIGN_FAILED. [object-thread] */
  relign_status (*render)(relign_assembly* assembly, const double* true_pose, uint32_t axes, uint64_t seed,
                          double error, uint64_t samples, float* pixels, relign_average* reached);
} relign_scene_average;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SCENE_AVERAGE_H */
