/*
 * relign/services.h: what a trial offers besides steps. The rules of all services are in relign/plugin.h.
 * Made by core/plugin_api/generate.py from services.toml.
 */
/* clang-format off */
#ifndef RELIGN_SERVICES_H
#define RELIGN_SERVICES_H

#include "types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* "relign.reference/1": the reference image O*, for the whole trial. Needs RELIGN_OBSERVES_IMAGES. */
#define RELIGN_SERVICE_REFERENCE "relign.reference/1"
typedef struct relign_reference_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  const relign_image* image; /* O*, of the size in relign_task */
} relign_reference_service;

/* "relign.measures/1": measures of the last capture, by name. Needs RELIGN_OBSERVES_IMAGES. */
#define RELIGN_SERVICE_MEASURES "relign.measures/1"
/* Arrays with `count` values, valid until the next call of `fields`. */
typedef struct relign_field_measures {
  uint32_t struct_size;
  uint32_t count;
  const relign_text* name; /* of the field */
  const double* mark_x_px; /* centre of the field's mark, from the middle of the first column */
  const double* mark_y_px; /* from the middle of the top row */
  const double* tangential; /* MTF, pixel included */
  const double* sagittal; /* MTF, pixel included */
} relign_field_measures;

typedef struct relign_measures_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* The names of all measures. [{"name": "mtf", "summary": "...", "arguments": {"cycles_per_pixel": "...", ...}}, ...];
   * a summary states the unit. [run-thread] */
  relign_status (*list)(void* context, const relign_text_sink* measures);
  /* One measure of the last capture. NaN when this capture does not allow it (no light, no edge in the region); that is
   * not a failure. RELIGN_BAD_ARGUMENT: an unknown measure, or arguments that it does not take. [run-thread] */
  relign_status (*measure)(void* context, relign_text name, relign_text arguments_json, double* value);
  /* The slanted edges of the last capture, all fields in the time of one. They have the order of the scene's "fields".
   * arguments: {"cycles_per_pixel": 0.1} or {"lp_per_mm": 50}. NaN: not in this capture. RELIGN_BAD_ARGUMENT: other
   * arguments, or a scene without fields. [run-thread] */
  relign_status (*fields)(void* context, relign_text arguments_json, relign_field_measures* fields);
} relign_measures_service;

/* "relign.regions/1": the next capture reads out some regions only, in less readout time. Needs RELIGN_OBSERVES_IMAGES.
 * Inside the regions pixels are those of the whole frame, bit for bit; the others are 0. The merit of such a capture is
 * computed from its regions; it never counts as the best measured one. */
#define RELIGN_SERVICE_REGIONS "relign.regions/1"
typedef struct relign_regions_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  uint32_t most; /* how many regions select accepts */
  /* Selects what the next capture of this trial reads out. Captures after it are whole frames again. A rectangle has at
   * least one pixel and is inside the image; rectangles may overlap; none: the whole frame. relign.run/1 starts with
   * whole frames. RELIGN_UNSUPPORTED: the scene captures whole frames only, and nothing is selected.
   * RELIGN_BAD_ARGUMENT: no such rectangles. [run-thread] */
  relign_status (*select)(void* context, const uint32_t* regions, uint32_t count);
} relign_regions_service;

/* "relign.prior/1": draws from the noise level's distribution. Needs RELIGN_OBSERVES_LEVEL. Draws use training seeds:
 * they are never the instance of this trial or of any benchmark. A station does not offer it. */
#define RELIGN_SERVICE_PRIOR "relign.prior/1"
typedef struct relign_prior_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* Draw `number` of the perturbations. As relign_noise_level_interface::draw writes it: {"start": [...], "distortion":
   * [[...]], "elements": {...}}, and "cure_shift" (of which the batch's mean is a part), "stage" and "batch" where the
   * level draws them. The same number is the same draw in every trial of this level and scene. RELIGN_FAILED: the noise
   * level failed. RELIGN_STOP. [run-thread] */
  relign_status (*draw)(void* context, uint64_t number, const relign_text_sink* drawn);
} relign_prior_service;

/* "relign.model/1": a simulator of the scene's design, with your own offsets and seeds; the scene's manifest may choose
 * a simpler one ("model_parameters"). Needs RELIGN_OBSERVES_DESIGN. It is independent of the instance: the same
 * offsets, pose and seed give the same pixels in every trial. The scene's manifest may give it other parameters than
 * the trial's scene ("model_parameters"). A station does not offer it. */
#define RELIGN_SERVICE_MODEL "relign.model/1"
typedef struct relign_model_lens relign_model_lens;

/* Arrays with `count` values, valid until the next call of `fields`. */
typedef struct relign_model_fields {
  uint32_t struct_size;
  uint32_t count;
  const double* x_px; /* place of the field's point, from the middle of the first column; NaN without light */
  const double* y_px; /* from the middle of the top row */
  const double* tangential; /* MTF of the lens alone, without pixels; 0 without light */
  const double* sagittal; /* MTF of the lens alone, without pixels */
} relign_model_fields;

typedef struct relign_model_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  relign_text scene_json; /* as relign_scene_interface::describe wrote it: axes, nominal_pose, elements, image */
  uint32_t image_width; /* pixels */
  uint32_t image_height; /* pixels */
  /* A lens with offsets as for relign_scene_interface::mount (mm, deg); {} is the perfect lens. The host unmounts the
   * rest when run returns. RELIGN_BAD_ARGUMENT: unusable offsets, or more than 16 lenses at a time. RELIGN_FAILED: the
   * scene failed. RELIGN_STOP. [run-thread] */
  relign_status (*mount)(void* context, relign_text offsets_json, relign_model_lens** lens);
  /* A noisy capture. pose: true pose of the lens itself, 0 to 1; no stage and no distortion is involved. seed: the
   * caller's choice; no frame of a trial uses its range. RELIGN_BAD_ARGUMENT: no such lens, or an invalid pose.
   * RELIGN_FAILED: the scene failed. RELIGN_STOP. [run-thread] */
  relign_status (*capture)(void* context, relign_model_lens* lens, const double* pose, uint32_t axes, uint64_t seed,
      float* pixels);
  /* The same without noise. RELIGN_UNSUPPORTED: the scene does not offer it. RELIGN_BAD_ARGUMENT: no such lens, or an
   * invalid pose. RELIGN_FAILED: the scene failed. RELIGN_STOP. [run-thread] */
  relign_status (*noise_free)(void* context, relign_model_lens* lens, const double* pose, uint32_t axes, float* pixels);
  /* A noise-free image and its derivatives, from the same rays: `samples` of them per pixel, at least 1. The image
   * comes first, then its derivatives by the axes of the pose, per whole travel; then for each of `elements` (numbered
   * from 0 in the order of the scene's "elements", each at most once) five by its offsets: shift_mm x, y, z (per mm)
   * and tilt_deg x, y (per degree). Other seeds give independent images. RELIGN_UNSUPPORTED: the scene does not offer
   * it. RELIGN_BAD_ARGUMENT: no such lens, an invalid pose, no samples, or an element that is not there or is named
   * twice. RELIGN_FAILED: the scene failed. RELIGN_STOP. [run-thread] */
  relign_status (*slopes)(void* context, relign_model_lens* lens, const double* pose, uint32_t axes, uint64_t seed,
      uint32_t samples, const uint32_t* elements, uint32_t count, float* pixels);
  /* Where this lens images the fields, and how sharply, from rays, without noise. They have the order of the scene's
   * "fields". arguments: {"cycles_per_pixel": 0.1} or {"lp_per_mm": 50}. RELIGN_UNSUPPORTED: the scene does not offer
   * it. RELIGN_BAD_ARGUMENT: no such lens, an invalid pose, other arguments, or a scene without fields. RELIGN_FAILED:
   * the scene failed. RELIGN_STOP. [run-thread] */
  relign_status (*fields)(void* context, relign_model_lens* lens, const double* pose, uint32_t axes, relign_text
      arguments_json, relign_model_fields* fields);
  /* One measure of the last image that capture or noise_free made of this lens, as relign.measures/1 has them for
   * captures of the trial. RELIGN_BAD_ARGUMENT: no such lens, no image of it, an unknown measure, or arguments that it
   * does not take. RELIGN_STOP. [run-thread] */
  relign_status (*measure)(void* context, relign_model_lens* lens, relign_text name, relign_text arguments_json, double*
      value);
  /* Frees the lens. RELIGN_BAD_ARGUMENT: no such lens. [run-thread] */
  relign_status (*unmount)(void* context, relign_model_lens* lens);
} relign_model_service;

/* "relign.history/1": what inspection measured on earlier modules of the batch. Needs RELIGN_OBSERVES_HISTORY. The glue
 * of modules from one batch cures alike: their shifts have a common mean, which a method can learn from the modules
 * before and aim off by it. Measured shifts are a function of the instances alone, whichever method aligned the earlier
 * modules and in whatever order trials ran. */
#define RELIGN_SERVICE_HISTORY "relign.history/1"
typedef struct relign_history_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  uint32_t modules; /* earlier modules of this batch; 0 for its first, on a station, and at a level without batches */
  /* The measured shift of the module `back` places before this one. back: 1 to `modules`. The shift is the true pose
   * after curing minus that before, with the errors of inspection, in fractions of the travel. RELIGN_BAD_ARGUMENT:
   * another module. RELIGN_FAILED: the noise level failed. RELIGN_STOP. [run-thread] */
  relign_status (*cure_shift)(void* context, uint32_t back, double* shift, uint32_t axes);
} relign_history_service;

/* "relign.run/1": another algorithm for some of your steps, from the current pose (hand-over). */
#define RELIGN_SERVICE_RUN "relign.run/1"
enum {
  RELIGN_RUN_STEPS_SPENT = 0, /* it used the steps it was granted, or the trial's last ones */
  RELIGN_RUN_FINISHED = 1     /* it returned earlier */
};

typedef struct relign_observation relign_observation; /* in relign/plugin.h */

/* Poses are commanded poses (axes values) of the caller's own trial. Pointers are valid until the next call of step, move or
 * run. */
typedef struct relign_run_outcome {
  uint32_t struct_size;
  uint32_t steps; /* used of the budget */
  int32_t end;    /* RELIGN_RUN_*; meaningless unless run returned RELIGN_OK */
  uint32_t reserved;
  const relign_observation* last; /* the current pose, as the caller's own step would have returned it */
  const relign_observation* best; /* lowest merit of those steps and of the pose before them, without image unless it is the
                                     last; null unless the caller is granted RELIGN_OBSERVES_MERIT */
  const double* recommendation;   /* of the inner algorithm; null when it made none. It counts only when the caller repeats it
                                     with relign_trial::recommend */
} relign_run_outcome;

typedef struct relign_run_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* Runs the algorithm that the caller's parameter `parameter` selects, with changes `parameters` to that algorithm's
   * own, for at most `steps` steps, at least 1. It drives a trial of its own: its step 0 is the last capture, its
   * budget is `steps` or what is left, its commanded coordinates are relative to the current pose unless both observe
   * the start, and it is granted only what both manifests declare. Stage, clocks and records are the caller's. Costs
   * the steps that it makes. RELIGN_STOP: no step was left, nothing was run. RELIGN_BAD_ARGUMENT: no such parameter or
   * unusable changes; nothing was run. RELIGN_FAILED: the inner algorithm failed; the outcome has the steps it made.
   * [run-thread] */
  relign_status (*run)(void* context, relign_text parameter, relign_text parameters_json, uint32_t steps,
      relign_run_outcome* outcome);
} relign_run_service;

/* "relign.prepared/1": pretraining data from other instances. For pretraining the host first runs one trial per *source
 * instance*: drawn from the same noise level, for the same scene and protocol, with separate seeds, so that no source
 * is the instance of any trial. In it `active` is 1; the algorithm moves, observes and saves what it needs. Its steps
 * there are not a result. Sources are run one after the other, from 0 to sources - 1, each with a new object and its
 * own budget and seed. Trials load what was saved last. */
#define RELIGN_SERVICE_PREPARED "relign.prepared/1"
typedef struct relign_prepared_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  uint32_t active; /* 1: on a source instance. 0: in a benchmark trial */
  uint32_t source; /* on a source instance: number of this source; else 0 */
  uint32_t sources; /* on a source instance: how many there are; else 0 */
  /* The bytes saved last: in a trial the pretrained data, on a source instance what the sources before saved. They come
   * from a file that anyone may have modified: check them. RELIGN_UNSUPPORTED: there are none (the first source; a
   * station; an algorithm whose parameters were changed by the one that runs it). RELIGN_FAILED: the pretraining
   * failed. [run-thread] */
  relign_status (*load)(void* context, const relign_text_sink* data);
  /* Replaces the saved bytes (any, not only text; at most 1 GiB). RELIGN_BAD_ARGUMENT: in a trial, or too many.
   * [run-thread] */
  relign_status (*save)(void* context, relign_text data);
} relign_prepared_service;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SERVICES_H */
