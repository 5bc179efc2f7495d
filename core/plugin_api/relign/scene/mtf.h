/*
 * relign/scene/mtf.h: optional ability of a scene: the MTF of a lens as built, for specifications such as
 * {"mtf": {"lp_per_mm": 80, "centre": 0.5, "corner": 0.35}}. Algorithms never observe it.
 *
 * This is the geometric MTF of the lens itself, from rays: without noise, diffraction, pixels and reflections. At a
 * point of the field it is that of the light in the plane of the sensor, for lp_per_mm line pairs per millimetre there,
 * over all wavelengths of the scene; the lower one of sagittal and tangential lines. Points of the field are places of
 * the target, the same for every lens and pose:
 *   "centre"   the middle of that part of the target whose ideal (undistorted) image is on the sensor
 *   "corner"   0.8 of the way from there to each of the part's four corners; the lowest value of the four, because a
 *              tilted lens blurs each of them differently
 * It is 0 where no light arrives.
 */
#ifndef RELIGN_SCENE_MTF_H
#define RELIGN_SCENE_MTF_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SCENE_MTF "relign.scene.mtf/1"
typedef struct relign_field_mtf {
  uint32_t struct_size;
  uint32_t reserved;
  double centre; /* 0 to 1 */
  double corner; /* 0 to 1 */
} relign_field_mtf;

typedef struct relign_scene_mtf {
  uint32_t struct_size;
  uint32_t reserved;
  /* Writes the MTF at a true pose (`axes` values). lp_per_mm: positive. A pure function of its arguments.
   * RELIGN_UNSUPPORTED: not for this scene; RELIGN_FAILED. [object-thread] */
  relign_status (*measure)(relign_assembly* assembly, const double* true_pose, uint32_t axes, double lp_per_mm,
                           relign_field_mtf* mtf);
} relign_scene_mtf;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SCENE_MTF_H */
