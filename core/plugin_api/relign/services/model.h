/*
 * relign/services/model.h: "relign.model/1", a simulator of the scene's design with the algorithm's own offsets and
 * seeds. Needs RELIGN_OBSERVES_DESIGN. The rules of all services are in relign/plugin.h.
 *
 * It is independent of the instance: the same offsets, pose and seed give the same pixels in every trial. The scene's
 * manifest may give it other parameters than the trial's scene ("model_parameters"). A station does not offer it.
 */
#ifndef RELIGN_SERVICES_MODEL_H
#define RELIGN_SERVICES_MODEL_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SERVICE_MODEL "relign.model/1"
typedef struct relign_model_lens relign_model_lens;
typedef struct relign_model_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  relign_text scene_json; /* as relign_scene_interface::describe wrote it: axes, nominal_pose, elements, image */
  uint32_t image_width;   /* pixels */
  uint32_t image_height;
  /* Writes a lens with offsets as for relign_scene_interface::mount (mm, deg); "{}" is the perfect lens. The host
   * unmounts the rest when run returns. RELIGN_STOP; RELIGN_BAD_ARGUMENT: unusable offsets, or more than 16 lenses at a
   * time; RELIGN_FAILED: the scene failed. [run-thread] */
  relign_status (*mount)(void* context, relign_text offsets_json, relign_model_lens** made);
  /* Writes a noisy capture into `pixels` (of the caller). true_pose: `axes` values, 0 to 1, the pose of the lens
   * itself; no stage and no distortion is involved. `seed` is the caller's choice; no frame of a trial uses its range.
   * RELIGN_STOP; RELIGN_BAD_ARGUMENT: no such lens, an invalid pose or no pixels; RELIGN_FAILED: the scene failed.
   * [run-thread] */
  relign_status (*capture)(void* context, relign_model_lens* lens, const double* true_pose, uint32_t axes,
                           uint64_t seed, float* pixels);
  /* The same without noise. RELIGN_UNSUPPORTED: the scene does not offer it. [run-thread] */
  relign_status (*noise_free)(void* context, relign_model_lens* lens, const double* true_pose, uint32_t axes,
                              float* pixels);
  /* RELIGN_BAD_ARGUMENT: no such lens. [run-thread] */
  relign_status (*unmount)(void* context, relign_model_lens* lens);
  /* Writes why the last service function of this trial failed. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_model_service;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SERVICES_MODEL_H */
