/*
 * relign/scene/fields.h: optional ability of a scene: where a lens as built images the fields of its
 * description, and how sharply, for specifications by field. Algorithms never observe it.
 *
 * A field's point is a point of the target, the same for every lens and pose: the one that the design images onto the
 * field's mark or, without a mark, onto the middle of its regions. Its place is the centroid of the light of that point
 * in the plane of the sensor. The MTF is that of relign/scene/mtf.h, of the lens itself, for line pairs across the
 * field's two edges ("tangential", "sagittal"); without edges on the target, along and across the radius. It is 0, and
 * the place NaN, where no light arrives.
 */
#ifndef RELIGN_SCENE_FIELDS_H
#define RELIGN_SCENE_FIELDS_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SCENE_FIELDS "relign.scene.fields/1"
/* Arrays of the caller, with `count` values. */
typedef struct relign_field_values {
  uint32_t struct_size;
  uint32_t count;
  const uint32_t* fields; /* in: numbers of fields, from 0 in the order of the description */
  double* x_px;           /* 0: centre of the first column */
  double* y_px;           /* 0: centre of the top row */
  double* tangential;     /* 0 to 1 */
  double* sagittal;       /* 0 to 1 */
} relign_field_values;

typedef struct relign_scene_fields {
  uint32_t struct_size;
  uint32_t reserved;
  /* Writes the values at a true pose (`axes` values). lp_per_mm: positive. A pure function of its arguments.
   * RELIGN_UNSUPPORTED: not for this scene; RELIGN_FAILED. [object-thread] */
  relign_status (*measure)(relign_assembly* assembly, const double* true_pose, uint32_t axes, double lp_per_mm,
                           relign_field_values* values);
} relign_scene_fields;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SCENE_FIELDS_H */
