/*
 * relign/scene/stage.h: optional ability of a scene: it owns its stage. Such a scene is a station: its own hexapod and
 * camera, whose distortion and start are unknown. Its description (relign_scene_interface::describe) has
 *   "owns_stage": true   offers this table; "nominal_pose" and "elements" may be omitted
 *   "truth": false       noise_free_mse is RELIGN_UNSUPPORTED (also allowed for a scene without its own stage; required
 *                        for a station)
 *
 * The host then never calls mount, unmount, capture and noise_free_mse of relign_scene_interface. It calls create,
 * describe, reference and get_extension, and per trial
 *   begin, capture, then for each step: move_by, capture
 * A station has one scene object, and the host never runs two of its trials at once. A trial may end after any call;
 * the next one starts with begin.
 *
 * RELIGN_FAILED fails the trial, which keeps the steps made until then. The object is then destroyed and created again.
 * The host repeats nothing: a station that wants retries makes them itself. Seconds are measured machine time (travel,
 * settling, exposure, readout), finite and not negative; the host adds none.
 */
#ifndef RELIGN_SCENE_STAGE_H
#define RELIGN_SCENE_STAGE_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SCENE_STAGE "relign.scene.stage/1"
typedef struct relign_stage_move {
  uint32_t struct_size;
  uint32_t reserved;
  uint64_t limits_low;    /* bit i: axis i met its lower limit during this move */
  uint64_t limits_high;   /* bit i: axis i met its upper limit */
  double machine_seconds; /* of this move, including settling */
  double* moved;          /* `axes` values of the host, which contain the requested move. If a limit cut the move, the
                             station writes the one that its encoders report. Valid during the call */
} relign_stage_move;

typedef struct relign_scene_stage {
  uint32_t struct_size;
  uint32_t reserved;
  /* Moves the station to a start pose. Equal seeds request the same start (and the same lens), as well as the station
   * can; the pose is not reported. Its time does not count. RELIGN_FAILED. [object-thread] */
  relign_status (*begin)(relign_scene* self, uint64_t seed);
  /* Moves by `axes` fractions of the travel in the description, relative to the current pose by the station's encoders.
   * A limit is not a failure: the station stops there and reports it in `made`. RELIGN_FAILED. [object-thread] */
  relign_status (*move_by)(relign_scene* self, const double* delta, uint32_t axes, relign_stage_move* made);
  /* Captures at the current pose into `pixels` (of the caller). RELIGN_FAILED. [object-thread] */
  relign_status (*capture)(relign_scene* self, float* pixels, double* machine_seconds);
} relign_scene_stage;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SCENE_STAGE_H */
