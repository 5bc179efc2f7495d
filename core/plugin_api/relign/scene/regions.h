/*
 * relign/scene/regions.h: optional ability of a scene: captures of some regions of the image, as sensors
 * with regions of interest read them out. A scene without it captures whole frames only.
 */
#ifndef RELIGN_SCENE_REGIONS_H
#define RELIGN_SCENE_REGIONS_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SCENE_REGIONS "relign.scene.regions/1"
typedef struct relign_scene_regions {
  uint32_t struct_size;
  uint32_t reserved;
  /* As relign_scene_interface::capture, for the pixels of `count` rectangles, at least 1. `regions` has four values for
   * each: first column, first row, columns, rows; at least one pixel, inside the image; they may overlap. Writes every
   * pixel of the regions into `pixels` (of the caller, a whole image), the same bits as in the whole capture; the host
   * sets the others to 0. Writes `share`, the pixels that are read out as a share of those of a whole capture, 0 to 1:
   * "readout_ms" of the description is multiplied by it. [object-thread] */
  relign_status (*capture)(relign_assembly* assembly, const double* true_pose, uint32_t axes, uint64_t frame_seed,
                           const uint32_t* regions, uint32_t count, float* pixels, double* share);
} relign_scene_regions;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SCENE_REGIONS_H */
