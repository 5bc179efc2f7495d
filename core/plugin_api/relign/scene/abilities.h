/*
 * relign/scene/abilities.h: the optional abilities of a scene's assemblies. get_extension of relign_scene_interface
 * returns their tables by id.
 *
 * All are pure functions of their arguments. pose: a true pose (`axes` values). pixels: whole images. Images and arrays
 * are memory of the caller. RELIGN_UNSUPPORTED: this assembly does not offer it; or RELIGN_FAILED.
 * Made by core/plugin_api/generate.py from scene.toml.
 */
/* clang-format off */
#ifndef RELIGN_SCENE_ABILITIES_H
#define RELIGN_SCENE_ABILITIES_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* "relign.scene.noise-free/1": A noise-free image, for pictures and reports. */
#define RELIGN_SCENE_NOISE_FREE "relign.scene.noise-free/1"
typedef struct relign_scene_noise_free {
  uint32_t struct_size;
  uint32_t reserved;
  /* [object-thread] */
  relign_status (*render_noise_free)(relign_assembly* assembly, const double* pose, uint32_t axes, float* pixels);
} relign_scene_noise_free;

/* "relign.scene.average/1": A noise-free image averaged to a stated standard error, for render --noise-free --error.
 * Averages until the standard error of a pixel is at most `error` (positive, in pixel values), or until a bound of the
 * scene's own; if `samples` is above 0, instead that many samples per pixel (rounded up by the scene). What was reached
 * may be more than `error`. Other seeds give independent images. A scene whose render_noise_free is exact does not need
 * it. standard_error: of a pixel, as root mean square over all pixels. samples_used: rays (or what the scene averages)
 * per pixel that were used. */
#define RELIGN_SCENE_AVERAGE "relign.scene.average/1"
typedef struct relign_scene_average {
  uint32_t struct_size;
  uint32_t reserved;
  /* [object-thread] */
  relign_status (*render_average)(relign_assembly* assembly, const double* pose, uint32_t axes, uint64_t seed,
      double error, uint64_t samples, float* pixels, double* standard_error, uint64_t* samples_used);
} relign_scene_average;

/* "relign.scene.slopes/1": A noise-free image and its derivatives, for render --derivatives and the service model. The
 * image averages `samples` rays per pixel (or what the scene averages), at least 1; behind it come its derivatives,
 * from the same rays: in the order of the axes, each per whole travel of its axis; then for each of `elements`
 * (numbered from 0 in the order of the description, each at most once) five by its offsets: shift_mm x, y, z (per mm)
 * and tilt_deg x, y (per degree). Other seeds give independent images. */
#define RELIGN_SCENE_SLOPES "relign.scene.slopes/1"
typedef struct relign_scene_slopes {
  uint32_t struct_size;
  uint32_t reserved;
  /* [object-thread] */
  relign_status (*render_slopes)(relign_assembly* assembly, const double* pose, uint32_t axes, uint64_t seed,
      uint32_t samples, const uint32_t* elements, uint32_t count, float* pixels);
} relign_scene_slopes;

/* "relign.scene.optimum/1": The pose at which a lens as built is best. Results are compared with it ("excess": what an
 * algorithm could still gain). Algorithms never observe it. true_pose: with the lowest noise-free MSE that the scene
 * can find. mse: an unbiased estimate there, in squared pixel values. standard_error: of that estimate. */
#define RELIGN_SCENE_OPTIMUM "relign.scene.optimum/1"
typedef struct relign_scene_optimum {
  uint32_t struct_size;
  uint32_t reserved;
  /* [object-thread] */
  relign_status (*own_optimum)(relign_assembly* assembly, uint64_t seed, double* true_pose, uint32_t axes, double* mse,
      double* standard_error);
} relign_scene_optimum;

/* "relign.scene.further-score/1": A further score at a pose; required of scenes that declare some. `which` numbers
 * those of the description's score ("further") from 0 in its order. Noise-free, from 0, in the unit of the description,
 * the better the lower. Algorithms never observe it. `seed` selects a random stream that no capture uses. */
#define RELIGN_SCENE_FURTHER_SCORE "relign.scene.further-score/1"
typedef struct relign_scene_further_score {
  uint32_t struct_size;
  uint32_t reserved;
  /* [object-thread] */
  relign_status (*further_score)(relign_assembly* assembly, const double* pose, uint32_t axes, uint64_t seed,
      uint32_t which, double* value);
} relign_scene_further_score;

/* "relign.scene.mtf/1": MTF at points of the field; required by suites with "spec": {"mtf": ...}. The geometric MTF of
 * the lens itself, from rays: without noise, diffraction, pixels and reflections. Algorithms never observe it. At a
 * point of the field it is that of the light in the plane of the sensor, for lp_per_mm (positive) line pairs per
 * millimetre there, over all wavelengths of the scene; the lower one of sagittal and tangential lines; 0 where no light
 * arrives. Points of the field are places of the target, the same for every lens and pose. centre: in the middle of
 * that part of the target whose ideal (undistorted) image is on the sensor. corner: 0.8 of the way from there to each
 * of the part's four corners; the lowest value of the four, because a tilted lens blurs each of them differently. */
#define RELIGN_SCENE_MTF "relign.scene.mtf/1"
typedef struct relign_scene_mtf {
  uint32_t struct_size;
  uint32_t reserved;
  /* [object-thread] */
  relign_status (*mtf)(relign_assembly* assembly, const double* pose, uint32_t axes, double lp_per_mm, double* centre,
      double* corner);
} relign_scene_mtf;

/* "relign.scene.fields/1": Where a lens images the fields, and how sharply; required by suites with field_mtf. Places
 * and MTF of fields of the scene's description, numbered by `which` from 0 in its order. Algorithms never observe them.
 * A field's point is a point of the target, the same for every lens and pose: the one that the design images onto the
 * field's mark or, without a mark, onto the middle of its regions. Its place is the centroid of the light of that point
 * in the plane of the sensor. The MTF (tangential, sagittal) is that of the ability "mtf", for line pairs across the
 * field's two edges; without edges on the target, along and across the radius. It is 0, and the place NaN, where no
 * light arrives. One row of results for each of `which`. x_px: from the centre of the first column. y_px: from the
 * centre of the top row. */
#define RELIGN_SCENE_FIELDS "relign.scene.fields/1"
typedef struct relign_scene_fields {
  uint32_t struct_size;
  uint32_t reserved;
  /* [object-thread] */
  relign_status (*fields)(relign_assembly* assembly, const double* pose, uint32_t axes, double lp_per_mm,
      const uint32_t* which, uint32_t count, double* x_px, double* y_px, double* tangential, double* sagittal);
} relign_scene_fields;

/* "relign.scene.regions/1": Captures of regions that an algorithm selects. As capture, for the pixels of some regions,
 * at least one, as sensors with regions of interest read them out. A scene without it captures whole frames only. A
 * region has at least one pixel and is inside the image; regions may overlap. Every pixel of the regions is written,
 * the same bits as in the whole capture, into a whole image, in which the host sets the others to 0. share: the pixels
 * that are read out as a share of those of a whole capture, by which "readout_ms" of the description is multiplied. */
#define RELIGN_SCENE_REGIONS "relign.scene.regions/1"
typedef struct relign_scene_regions {
  uint32_t struct_size;
  uint32_t reserved;
  /* [object-thread] */
  relign_status (*capture_regions)(relign_assembly* assembly, const double* pose, uint32_t axes, uint64_t seed,
      const uint32_t* regions, uint32_t count, float* pixels, double* share);
} relign_scene_regions;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SCENE_ABILITIES_H */
