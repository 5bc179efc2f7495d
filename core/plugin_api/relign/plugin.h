/*
 * relign/plugin.h: the only binary interface between relign-bench and its plugins.
 *
 * Scenes, noise levels and algorithms (optimizers and agents) are shared libraries that the host loads at run time. All
 * that crosses the border is in this header and in those that it includes: fixed-width integers, doubles,
 * {pointer, size} views, UTF-8 JSON, opaque handles, tables of functions. No C++ type, exception or allocation crosses.
 *
 * C++ authors include relign/plugin.hpp instead, which wraps this interface in classes and guards every entry point.
 * This header is for that wrapper, for the host, and for other languages.
 *
 *   plugin.h    host, parameters, algorithms, noise levels, scenes, the library
 *   types.h     status, text, image
 *   services.h  what a trial offers besides steps
 *   scene/      optional abilities of a scene, one header for each
 *
 * Rules
 *  - Every struct but relign_text starts with `struct_size`, set by its writer. A reader never accesses members beyond
 *    the writer's struct_size, and never copies more of a struct than that.
 *  - A plugin library exports one data symbol, `relign_plugin_entry`. Nothing runs at load. Libraries are never
 *    unloaded.
 *  - Major versions must be equal.
 *  - The side that creates an object destroys it, through its own table. The other side copies what it keeps. Views
 *    (relign_text, relign_image, arrays) are borrowed; each function states for how long.
 *  - Functions never throw and never unwind. They return a relign_status; before a plugin returns a failure it may call
 *    host->fail with a message for the user.
 *  - RELIGN_STOP is not a failure: the budget is spent or the user stopped the run. Return promptly.
 *  - Poses are arrays of `axes` doubles, one for each axis of the scene. True poses are 0 to 1 on every axis, fractions
 *    of the travel. Pixels of a caller are width x height floats, tightly packed, row 0 at the top.
 *  - A plugin leaves floating-point mode, locale, working directory, signal handlers and stdout unchanged.
 *
 * Rules of services
 *  - They are called in the thread that called run, until run returns, in any order. A call from another thread returns
 *    RELIGN_BAD_ARGUMENT. Tables, `context` and every pointer that they return are valid until run returns, unless the
 *    function states less.
 *  - They cost no step, except relign.run/1. Time spent in them is the algorithm's own time.
 *  - After RELIGN_BAD_ARGUMENT and RELIGN_FAILED relign_trial::why has the message, until the next call of a service of
 *    the same trial. A function whose result has nowhere to go (a null pointer) returns RELIGN_BAD_ARGUMENT. A text
 *    `x_json` is a JSON object; empty text is "{}".
 *  - Where a function may return RELIGN_STOP: the user stopped the run, nothing was done. Return promptly.
 *
 * Threads: every function is marked with where it is called.
 *   [any-thread]     in any thread, several at once
 *   [object-thread]  in one thread at a time for one object; for different objects in several threads at once
 *   [run-thread]     in the thread that called relign_algorithm_interface::run, until run returns
 *
 * Versions
 *  - From the first release on, version 1 only grows (CONTRIBUTING.md): a library built for it runs in every host of
 *    version 1. What a plugin may lack, or a host, is a table that is looked up by its id and may be null.
 */
#ifndef RELIGN_PLUGIN_H
#define RELIGN_PLUGIN_H

#include <stdint.h>

#include "scene/abilities.h"
#include "scene/batch.h"
#include "scene/stage.h"
#include "services.h"
#include "types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_ABI_MAJOR 1
#define RELIGN_ABI_MINOR 0

/* ---- what the host offers to every plugin ------------------------------------------------- */

enum { RELIGN_LOG_DEBUG = 0, RELIGN_LOG_INFO = 1, RELIGN_LOG_WARNING = 2 };

/* Valid from create until destroy of the object that got it. */
typedef struct relign_host {
  uint32_t struct_size;
  uint32_t abi_major;
  uint32_t abi_minor;
  uint32_t threads; /* how many threads this object may use for its own work, at least 1 */
  void* context;
  relign_text plugin_folder; /* absolute path of the manifest and the data files */
  relign_text cache_folder;  /* absolute path, writable; empty: none. Write to a temporary file, then rename it */
  /* Keeps a message for the user: why the call that now returns RELIGN_FAILED failed. Copies it. Cannot fail.
   * [any-thread] */
  void (*fail)(void* context, relign_text message);
  /* Logs a line. level: RELIGN_LOG_*. Copies it. Cannot fail. [any-thread] */
  void (*log)(void* context, int32_t level, relign_text message);
  /* Null for an unknown id; no id is defined yet. [any-thread] */
  const void* (*get_extension)(void* context, relign_text id);
} relign_host;

/* The effective parameters: the manifest's defaults, then the preset's, then the user's values, checked against the
 * manifest. Valid during create only, and so are the texts of `text`. The getters write one value and return RELIGN_OK,
 * or return RELIGN_BAD_ARGUMENT for an unknown name or another type and write nothing. */
typedef struct relign_parameters {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  relign_text json; /* all of them, one canonical JSON object */
  /* In the unit that the manifest states. [object-thread] */
  relign_status (*number)(void* context, relign_text name, double* value);
  /* [object-thread] */
  relign_status (*integer)(void* context, relign_text name, int64_t* value);
  /* 0 or 1. [object-thread] */
  relign_status (*boolean)(void* context, relign_text name, int32_t* value);
  /* For a file its absolute path, for an algorithm its id. [object-thread] */
  relign_status (*text)(void* context, relign_text name, relign_text* value);
} relign_parameters;

/* ---- algorithms: optimizers and agents ---------------------------------------------------- */

/* What an algorithm may observe. The manifest declares it, the host gives no more. */
enum {
  RELIGN_OBSERVES_IMAGES = 1 << 0, /* pixels of each capture */
  RELIGN_OBSERVES_MERIT = 1 << 1,  /* a scalar per capture, smaller is better */
  RELIGN_OBSERVES_START = 1 << 2, /* the true start pose: commanded coordinates are the stage's own, nominal pose 0.5 */
  RELIGN_OBSERVES_BOX = 1 << 3,   /* the box to search */
  RELIGN_OBSERVES_DESIGN = 1 << 4, /* the scene's design */
  RELIGN_OBSERVES_LEVEL = 1 << 5,  /* the noise level's distribution */
  RELIGN_OBSERVES_HISTORY = 1 << 6 /* what inspection measured on earlier modules of the batch */
};

/* The facts of one trial. Valid during run. */
typedef struct relign_task {
  uint32_t struct_size;
  uint32_t axes;           /* degrees of freedom, 1 to 64 */
  uint32_t budget;         /* steps granted after step 0 */
  uint32_t observes;       /* RELIGN_OBSERVES_* bits that this trial grants */
  uint64_t seed;           /* the algorithm's own seed: same seed, same trial */
  const double* box_lower; /* axes values each, commanded coordinates; null unless RELIGN_OBSERVES_BOX */
  const double* box_upper;
  double largest_move;  /* per axis and step, fraction of the travel; infinity when unlimited. Longer moves are cut */
  uint32_t image_width; /* pixels; 0 unless RELIGN_OBSERVES_IMAGES */
  uint32_t image_height;
  relign_text axes_json;     /* [{"name": "x", "unit": "mm", "travel": 2.0}, ...]: travel = length of [0, 1] */
  relign_text readings_json; /* [{"name": "loss", "unit": "dB"}, ...]: with them begins the last row of a capture, a
                                pixel each; [] of a scene without readings, and unless RELIGN_OBSERVES_IMAGES */
} relign_task;

/* One step: a move and the capture after it. The host fills it, up to the caller's struct_size. Pointers are valid
 * until the next first, step or move of the same trial. */
typedef struct relign_observation {
  uint32_t struct_size;
  uint32_t step;             /* 0 = the capture at the start pose */
  const double* pose;        /* commanded pose, task->axes values in fractions of the travel. Relative to the start pose
                                (all 0) unless RELIGN_OBSERVES_START */
  double merit;              /* NaN unless RELIGN_OBSERVES_MERIT */
  uint64_t limits_low;       /* bit i: axis i met its lower limit during this move */
  uint64_t limits_high;      /* bit i: axis i met its upper limit */
  const relign_image* image; /* null unless RELIGN_OBSERVES_IMAGES */
  double machine_seconds;    /* simulated machine time since the start */
} relign_observation;

/* The host's side of one trial. All functions return RELIGN_BAD_ARGUMENT, without effect, for a wrong number of axes,
 * non-finite values, and an observation that is null or too small. To an algorithm that makes 100 000 such requests, or
 * as many after RELIGN_STOP, they return RELIGN_FAILED. */
typedef struct relign_trial {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  const relign_task* task;
  /* Writes step 0. Costs no step. May be called again and returns the same capture; RELIGN_BAD_ARGUMENT after a step.
   * [run-thread] */
  relign_status (*first)(void* context, relign_observation* seen);
  /* Moves to a commanded pose (`axes` values) and captures. RELIGN_STOP: the budget is spent or the run was stopped;
   * nothing was moved or captured. [run-thread] */
  relign_status (*step)(void* context, const double* pose, uint32_t axes, relign_observation* seen);
  /* The same for a move (`axes` fractions of the travel) relative to the current pose. [run-thread] */
  relign_status (*move)(void* context, const double* delta, uint32_t axes, relign_observation* seen);
  /* Recommends a commanded pose (`axes` values) as the final pose. Costs no step and reveals nothing. Holds until the
   * next recommendation. [run-thread] */
  relign_status (*recommend)(void* context, const double* pose, uint32_t axes);
  /* The table of a service by its id (services.h), valid until run returns. Null when the host does not offer it or the
   * manifest does not declare what it needs. [run-thread] */
  const void* (*get_service)(void* context, relign_text id);
  /* Writes why the last service function of this trial failed. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*why)(void* context, const relign_text_sink* reason);
} relign_trial;

#define RELIGN_ALGORITHM_INTERFACE "relign.algorithm/1"
typedef struct relign_algorithm_interface {
  uint32_t struct_size;
  uint32_t reserved;
  /* Writes a new object. RELIGN_FAILED: the trial fails. [object-thread] */
  relign_status (*create)(const relign_host* host, const relign_parameters* parameters, relign_algorithm** made);
  /* Drives one whole trial. Called once per object. RELIGN_OK: the trial is finished; if steps are left, the
   * recommendation is carried forward. RELIGN_STOP: the same, after a RELIGN_STOP of the trial. Others: the trial
   * failed; its steps are kept. [object-thread] */
  relign_status (*run)(relign_algorithm* self, const relign_trial* trial);
  /* [object-thread] */
  void (*destroy)(relign_algorithm* self);
  /* Null for an unknown id; no id is defined yet. May be null itself. [object-thread] */
  const void* (*get_extension)(relign_algorithm* self, relign_text id);
} relign_algorithm_interface;

/* ---- noise levels --------------------------------------------------------------------------- */

#define RELIGN_NOISE_LEVEL_INTERFACE "relign.noise-level/1"
typedef struct relign_noise_level_interface {
  uint32_t struct_size;
  uint32_t reserved;
  /* Writes a new object. RELIGN_FAILED: its trials fail. [object-thread] */
  relign_status (*create)(const relign_host* host, const relign_parameters* parameters, relign_noise_level** made);
  /* Writes one draw of the perturbations W, a pure function of its arguments. scene_json: what the scene's describe
   * wrote. Writes, for n axes, {"start": [n values in 0..1], "distortion": [[n x n]],
   * "elements": {"L2": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}, "waist": {"value": 0.05}}}, the latter for an
   * uncertain quantity of the scene, and if glue matters
   * "cure_shift": [n fractions of the travel], the shift of the lens while the glue cures. Optionally errors
   * of the stage beyond the distortion, "stage": {"backlash": [n], "repeatability": [n], "encoder_step": [n],
   * "drift": [n], "drift_seconds": s}, each member optional, in fractions of the travel: full width of the play,
   * standard deviation after a move, resolution of the encoder (0: not rounded), and drift in the end, signed, with the
   * time constant s of machine time. And "batch": {"size": 25, "cure_shift": [n], "inspection": [n]}: instances come in
   * batches of that size, the same in all draws; the host adds to "cure_shift" the batch's mean, "cure_shift" of the
   * draw with the batch's own seed; "inspection" is the standard deviation with which inspection measures a cure shift.
   * RELIGN_FAILED: cannot draw for this scene. [object-thread] */
  relign_status (*draw)(relign_noise_level* self, uint64_t seed, relign_text scene_json, const relign_text_sink* drawn);
  /* [object-thread] */
  void (*destroy)(relign_noise_level* self);
  /* Null for an unknown id; no id is defined yet. May be null itself. [object-thread] */
  const void* (*get_extension)(relign_noise_level* self, relign_text id);
} relign_noise_level_interface;

/* ---- scenes --------------------------------------------------------------------------------- */

#define RELIGN_SCENE_INTERFACE "relign.scene/1"
/* One scene object per worker. Its assemblies are used in the scene's thread, or in one thread each. Images and ground
 * truth are pure functions of their arguments. RELIGN_FAILED of any function fails the trial; the object is then
 * destroyed and created again. */
typedef struct relign_scene_interface {
  uint32_t struct_size;
  uint32_t reserved;
  /* Writes a new object. [object-thread] */
  relign_status (*create)(const relign_host* host, const relign_parameters* parameters, relign_scene** made);
  /* Writes one JSON object:
   *   "name": "relign_od"
   *   "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1}, ...]   pose 0..1 maps to lower..upper; units other
   *                                                                         than mm and deg need "speed_per_s"
   *   "nominal_pose": [0.5, ...]
   *   "image": {"width": 200, "height": 200, "white": 0.115}                white = display value of a lit pixel
   *   "readings": [{"name": "loss", "unit": "dB"}, ...]                     instead, or beside it: the last row of a
   *                                                                         capture begins with them, a pixel each
   *   "elements": ["L1", ...]                                               those that a noise level may offset
   * and optionally
   *   "machine_time": {"speed_mm_per_s": 5, ...}, "spec": {...}             defaults for suites
   *   "geometry": {"pivot_z_mm": 0,                                         positions on the axis of the pivot of
   *                "elements": {"L1": {"front_z_mm": 0, "back_z_mm": 1.5},  tilts and of the vertices
   *                             ...}}
   *   "uncertain": [{"name": "waist", "unit": "um",                         what noise levels draw besides the
   *                  "law": {"law": "normal", "sigma": 0.1}}, ...]          offsets of elements
   *   "score": {"name": "insertion loss", "unit": "dB",                     what poses are judged by instead of the
   *             "scale": "linear" (or "log"), "resolution": 0.01,           RMSE, required with readings: from 0, lower
   *             "reading": "loss",                                          is better; the reading that measures it;
   *             "further": [{"name": "FWHM", "unit": "arcsec"}, ...]}       at most 4 others, which rank nothing
   *   "files": ["/abs/path", ...]                                           data files that determine the image
   *   "summary": "..."
   * [object-thread] */
  relign_status (*describe)(relign_scene* self, const relign_text_sink* description);
  /* Writes O*: the noise-free image of the perfect lens at the nominal pose, of the size in the description. Its pixels
   * are valid until destroy. [object-thread] */
  relign_status (*reference)(relign_scene* self, relign_image* image);
  /* Writes a lens with these offsets: {"L2": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}, ...}; "{}" is the perfect
   * lens. [object-thread] */
  relign_status (*mount)(relign_scene* self, relign_text offsets_json, relign_assembly** made);
  /* Before destroy of its scene. [object-thread] */
  void (*unmount)(relign_assembly* assembly);
  /* Renders a noisy capture at a true pose into `pixels` (of the caller). [object-thread] */
  relign_status (*capture)(relign_assembly* assembly, const double* true_pose, uint32_t axes, uint64_t frame_seed,
                           float* pixels);
  /* Writes an unbiased estimate of the noise-free MSE against O* at a true pose (may be slightly negative), and its
   * standard error, both in squared pixel values; of a scene with a "score" that score, not squared, in its unit.
   * `seed` selects a random stream that no capture uses.
   * RELIGN_UNSUPPORTED: the scene has no ground truth ("truth": false in its description). [object-thread] */
  relign_status (*noise_free_mse)(relign_assembly* assembly, const double* true_pose, uint32_t axes, uint64_t seed,
                                  double* mse, double* standard_error);
  /* [object-thread] */
  void (*destroy)(relign_scene* self);
  /* The table of an optional ability by its id (scene/), valid as long as the scene; null when not offered. May be null
   * itself. [object-thread] */
  const void* (*get_extension)(relign_scene* self, relign_text id);
} relign_scene_interface;

/* ---- the library ---------------------------------------------------------------------------- */

typedef struct relign_plugin_description {
  uint32_t struct_size;
  uint32_t abi_major;
  uint32_t abi_minor;
  uint32_t reserved;
  const char* manifest_json; /* NUL-terminated; byte for byte the relign-plugin.json beside the library */
  const char* build_info;    /* NUL-terminated: compiler and its version */
  /* The table of a RELIGN_*_INTERFACE id, valid for ever; null for others. [any-thread] */
  const void* (*get_interface)(relign_text id);
} relign_plugin_description;

#if defined(_WIN32)
#define RELIGN_EXPORT __declspec(dllexport)
#else
#define RELIGN_EXPORT __attribute__((visibility("default")))
#endif

#define RELIGN_PLUGIN_ENTRY_SYMBOL "relign_plugin_entry"

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_PLUGIN_H */
