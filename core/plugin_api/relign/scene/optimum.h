/*
 * relign/scene/optimum.h: optional ability of a scene: the pose at which a lens as built is best. Results
 * are compared with it ("excess": what an algorithm could still gain). Algorithms never observe it.
 */
#ifndef RELIGN_SCENE_OPTIMUM_H
#define RELIGN_SCENE_OPTIMUM_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SCENE_OPTIMUM "relign.scene.optimum/1"
typedef struct relign_scene_optimum {
  uint32_t struct_size;
  uint32_t reserved;
  /* Writes the true pose (`axes` values, 0 to 1) with the lowest noise-free MSE that the scene can find, and an
   * unbiased estimate of the MSE there with its standard error, in squared pixel values. A pure function of assembly
   * and seed. RELIGN_UNSUPPORTED: not for this scene; RELIGN_FAILED. [object-thread] */
  relign_status (*find)(relign_assembly* assembly, uint64_t seed, double* true_pose, uint32_t axes, double* mse,
                        double* standard_error);
} relign_scene_optimum;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SCENE_OPTIMUM_H */
