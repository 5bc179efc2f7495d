/*
 * relign/scene/batch.h: optional ability of a scene: captures and noise-free MSE of many assemblies in one
 * call on an NVIDIA GPU, where images stay. Values are those of relign_scene_interface, bit for bit; a scene that
 * cannot keep this for its captures documents what is the same: those of `lens_system` with transport `ghost` have the
 * same distribution.
 *
 * The GPU is the first one of CUDA. Images are written to memory of the caller in its primary context, which libraries
 * such as PyTorch use.
 */
#ifndef RELIGN_SCENE_BATCH_H
#define RELIGN_SCENE_BATCH_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SCENE_BATCH "relign.scene.batch/1"
/* Arrays of the caller, with `count` elements. */
typedef struct relign_batch {
  uint32_t struct_size;
  uint32_t count;
  relign_assembly* const* assemblies; /* of this scene; one may occur several times */
  const double* true_poses;           /* `axes` values for each */
  const uint64_t* seeds;              /* as of capture and noise_free_mse */
} relign_batch;

typedef struct relign_scene_batch {
  uint32_t struct_size;
  uint32_t reserved;
  /* Opens the GPU, before the first call of the other functions. RELIGN_UNSUPPORTED: this scene or this machine cannot;
   * writes one sentence that says why. [object-thread] */
  relign_status (*open)(relign_scene* self, const relign_text_sink* why);
  /* Captures element i into image places[i] of `images`, which is memory of the GPU; no two into one. Writes rmse[i],
   * the RMSE of that image against the reference. Waits for all work on the GPU first, and returns when the images are
   * complete. [object-thread] */
  relign_status (*capture)(relign_scene* self, const relign_batch* batch, uint32_t axes, const uint32_t* places,
                           float* images, double* rmse);
  /* Writes the noise-free MSE and standard error of each element. [object-thread] */
  relign_status (*noise_free_mse)(relign_scene* self, const relign_batch* batch, uint32_t axes, double* mse,
                                  double* standard_error);
} relign_scene_batch;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SCENE_BATCH_H */
