/*
 * relign/plugin.h: the one binary interface between relign-bench and its plugins.
 *
 * What it is for: scenes, noise levels and algorithms (optimizers and agents) live in shared
 * libraries that the host loads at run time. This header is everything that crosses: fixed-width
 * integers, doubles, {pointer, size} views, UTF-8 JSON, opaque handles, tables of functions.
 * No C++ type, exception or allocation crosses it.
 *
 * When to use something else: C++ authors include relign/plugin.hpp, which wraps this header in
 * a few classes and guards every entry point. This header is for that wrapper, for the host, and
 * for other languages.
 *
 * Rules
 *  - Every struct but relign_text starts with `struct_size`, set by whoever fills it. A reader never
 *    touches members beyond the writer's struct_size, and never copies more of a struct than that.
 *  - A plugin library exports one data symbol, `relign_plugin_entry`. Nothing runs at load.
 *    Libraries are never unloaded.
 *  - Major versions must be equal and the plugin's `min_host_minor` at most the host's minor.
 *  - Whoever creates an object destroys it, through its own table. The other side copies what it
 *    keeps. Views (relign_text, relign_image, arrays) are borrowed: each function says for how long.
 *  - Functions never throw and never unwind. They return a relign_status; before returning a
 *    failure a plugin may call host->fail with a sentence for the user.
 *  - RELIGN_STOP is no failure: the budget is spent or the user stopped the run. Return promptly.
 *  - Threads: one object is used by one thread at a time; different objects may be used by
 *    different threads at once. Exceptions are said at the function.
 *  - A plugin leaves floating-point mode, locale, working directory, signal handlers and stdout
 *    as it found them.
 *
 * Versions
 *  - Version 1 is frozen: a library built for it loads and runs in every host of version 1.
 *  - A change of this header raises the minor version and may only append: a member at the end of a
 *    struct that has struct_size, a value at the end of an enum, an id with its struct. Nothing is
 *    removed, renamed, moved or given another type or meaning. Whoever reads a member that came
 *    later asks struct_size first. relign_text never changes.
 *  - A plugin for a later minor loads in an older host, unless its min_host_minor says otherwise.
 */
#ifndef RELIGN_PLUGIN_H
#define RELIGN_PLUGIN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_ABI_MAJOR 1
#define RELIGN_ABI_MINOR 0

/* ---- plain types ------------------------------------------------------------------------ */

typedef int32_t relign_status;
enum {
  RELIGN_OK = 0,            /* done */
  RELIGN_STOP = 1,          /* budget spent or run stopped: return promptly, not an error */
  RELIGN_FAILED = -1,       /* could not be done; host->fail has the sentence */
  RELIGN_BAD_ARGUMENT = -2, /* the caller broke a rule stated here (wrong number of axes, NaN) */
  RELIGN_UNSUPPORTED = -3   /* this object does not offer what was asked for */
};

/* UTF-8, not necessarily NUL-terminated. data may be null when size is 0. */
typedef struct relign_text {
  const char* data;
  uint64_t size;
} relign_text;

/* Receives one text. The callee copies it before it returns. */
typedef struct relign_text_sink {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  void (*write)(void* context, relign_text text);
} relign_text_sink;

enum { RELIGN_SAMPLE_FLOAT32 = 1 };

/* Row 0 is the top row. Value = irradiance for an emitter of radiance 1 (no unit). */
typedef struct relign_image {
  uint32_t struct_size;
  uint32_t sample_format; /* RELIGN_SAMPLE_FLOAT32 */
  uint32_t width;         /* pixels */
  uint32_t height;        /* pixels */
  uint32_t channels;      /* 1 */
  uint32_t reserved;
  const float* pixels;       /* row-major */
  uint64_t row_stride_bytes; /* from one row to the next */
} relign_image;

/* ---- what the host offers to every plugin ------------------------------------------------- */

enum { RELIGN_LOG_DEBUG = 0, RELIGN_LOG_INFO = 1, RELIGN_LOG_WARNING = 2 };

/* Valid from create until destroy of the object it was given to. Any thread. */
typedef struct relign_host {
  uint32_t struct_size;
  uint32_t abi_major;
  uint32_t abi_minor;
  uint32_t threads; /* how many threads this object may use for its own work, at least 1 */
  void* context;
  relign_text plugin_folder; /* where manifest and data files lie */
  relign_text cache_folder;  /* may be written; empty when there is none. Use temporary file + rename */
  void (*fail)(void* context, relign_text message);
  void (*log)(void* context, int32_t level, relign_text message);
  const void* (*get_extension)(void* context, relign_text id); /* null when unknown */
} relign_host;

/* The effective parameters: the manifest's defaults, then the preset's, then the user's values,
 * checked against the manifest. Valid during create only. Each getter returns RELIGN_OK, or
 * RELIGN_BAD_ARGUMENT for an unknown name or another type. Text views live as long as this. */
typedef struct relign_parameters {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  relign_text json; /* all of them, one canonical JSON object */
  relign_status (*number)(void* context, relign_text name, double* value);
  relign_status (*integer)(void* context, relign_text name, int64_t* value);
  relign_status (*boolean)(void* context, relign_text name, int32_t* value);
  relign_status (*text)(void* context, relign_text name, relign_text* value); /* files: absolute path */
} relign_parameters;

/* ---- algorithms: optimizers and agents ---------------------------------------------------- */

/* What an algorithm may be shown. The manifest declares it, the host gives no more. */
enum {
  RELIGN_OBSERVES_IMAGES = 1 << 0, /* pixels of each capture */
  RELIGN_OBSERVES_MERIT = 1 << 1,  /* a scalar per capture, smaller is better */
  RELIGN_OBSERVES_START = 1 << 2, /* the true start pose: commanded coordinates are the stage's own, nominal pose 0.5 */
  RELIGN_OBSERVES_BOX = 1 << 3,   /* the box to search */
  RELIGN_OBSERVES_DESIGN = 1 << 4, /* the scene's design */
  RELIGN_OBSERVES_LEVEL = 1 << 5   /* the noise level's distribution */
};

/* The frame of one trial. Valid during run. */
typedef struct relign_task {
  uint32_t struct_size;
  uint32_t axes;           /* degrees of freedom, 1 to 64 */
  uint32_t budget;         /* steps granted after step 0 */
  uint32_t observes;       /* RELIGN_OBSERVES_* bits that this trial grants */
  uint64_t seed;           /* the algorithm's own seed: same seed, same trial */
  const double* box_lower; /* axes values each, commanded coordinates; null unless RELIGN_OBSERVES_BOX */
  const double* box_upper;
  double largest_move;  /* per axis and step, share of the travel; infinity when unlimited. Longer moves are cut */
  uint32_t image_width; /* pixels; 0 unless RELIGN_OBSERVES_IMAGES */
  uint32_t image_height;
  relign_text axes_json; /* [{"name": "x", "unit": "mm", "travel": 2.0}, ...]: travel = length of [0, 1] */
} relign_task;

/* One step: a move and the capture after it. Filled by the host; pointers are valid until the
 * next first, step or move of the same trial. */
typedef struct relign_observation {
  uint32_t struct_size;
  uint32_t step;             /* 0 = the capture at the start pose */
  const double* pose;        /* commanded pose, task->axes values. Counts from the start pose (all 0)
                                unless RELIGN_OBSERVES_START */
  double merit;              /* NaN unless RELIGN_OBSERVES_MERIT */
  uint64_t limits_low;       /* bit i: axis i met its lower limit during this move */
  uint64_t limits_high;      /* bit i: axis i met its upper limit */
  const relign_image* image; /* null unless RELIGN_OBSERVES_IMAGES */
  double machine_seconds;    /* simulated machine time since the start */
} relign_observation;

/* The host's side of one trial. Use from the thread that called run, during run. */
typedef struct relign_trial {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  const relign_task* task;
  /* Step 0. Costs nothing; may be called again, and returns the same capture until a step is made. */
  relign_status (*first)(void* context, relign_observation* seen);
  /* Moves to an absolute commanded pose and captures. RELIGN_STOP: nothing was moved or captured. */
  relign_status (*step)(void* context, const double* pose, uint32_t axes, relign_observation* seen);
  /* The same for a move relative to where the stage is. */
  relign_status (*move)(void* context, const double* delta, uint32_t axes, relign_observation* seen);
  /* "I would glue here now": a commanded pose. Costs nothing, tells nothing. Stays until the next one. */
  relign_status (*recommend)(void* context, const double* pose, uint32_t axes);
  /* Optional services by string id, null when not offered: RELIGN_SERVICE_* below. */
  const void* (*get_service)(void* context, relign_text id);
} relign_trial;

typedef struct relign_algorithm relign_algorithm;

#define RELIGN_ALGORITHM_INTERFACE "relign.algorithm/1"
typedef struct relign_algorithm_interface {
  uint32_t struct_size;
  uint32_t reserved;
  relign_status (*create)(const relign_host* host, const relign_parameters* parameters, relign_algorithm** made);
  /* Drives one whole trial. Called once per object. Returning RELIGN_OK before a RELIGN_STOP was
   * seen declares the trial finished: the recommendation is carried forward. */
  relign_status (*run)(relign_algorithm* self, const relign_trial* trial);
  void (*destroy)(relign_algorithm* self);
  const void* (*get_extension)(relign_algorithm* self, relign_text id); /* may be null */
} relign_algorithm_interface;

/* ---- services of a trial ------------------------------------------------------------- */

/* What more a trial offers to its algorithm, by id through relign_trial::get_service. Null when
 * the host does not offer it, or when the manifest does not declare what it needs ("observes").
 *  - Call from the thread that called run, during run, in any order. The tables, `context` and every
 *    pointer they give are valid until run returns, unless the function says less.
 *  - Services cost no step but in relign.run/1. Time spent in them is the algorithm's own time.
 *  - RELIGN_BAD_ARGUMENT and RELIGN_FAILED: `why` has the sentence, until the next call of a service of
 *    the same trial.
 *  - draw, run and the model's mount, capture and noise_free return RELIGN_STOP once the user stopped the
 *    run: nothing was done, return promptly. */

/* relign.reference/1, needs RELIGN_OBSERVES_IMAGES: O*, the image to be reached. */
#define RELIGN_SERVICE_REFERENCE "relign.reference/1"
typedef struct relign_reference_service {
  uint32_t struct_size;
  uint32_t reserved;
  const relign_image* image; /* of the size that relign_task tells */
} relign_reference_service;

/* relign.measures/1, needs RELIGN_OBSERVES_IMAGES: what the last capture says of its own sharpness. */
#define RELIGN_SERVICE_MEASURES "relign.measures/1"
typedef struct relign_measures_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* Writes [{"name": "mtf", "summary": "...", "arguments": {"cycles_per_pixel": "...", ...}}, ...]. */
  relign_status (*list)(void* context, const relign_text_sink* measures);
  /* One measure of the last capture. arguments_json: an object; empty text is "{}". The value is NaN when
   * this capture does not allow it (no light, no edge in the region): that is no failure.
   * RELIGN_BAD_ARGUMENT: no such measure, or arguments it does not take. */
  relign_status (*measure)(void* context, relign_text name, relign_text arguments_json, double* value);
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_measures_service;

/* relign.prior/1, needs RELIGN_OBSERVES_LEVEL: draws from the noise level's distribution, of the training seeds:
 * never the instance of this trial nor of any benchmark. */
#define RELIGN_SERVICE_PRIOR "relign.prior/1"
typedef struct relign_prior_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* Writes draw `number` of W, as relign_noise_level_interface::draw does. The same number is the same
   * draw in every trial of this level and scene. */
  relign_status (*draw)(void* context, uint64_t number, const relign_text_sink* drawn);
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_prior_service;

/* relign.run/1, offered when the manifest has a parameter of type "algorithm": runs that algorithm for some
 * steps of this trial's budget, from where the stage is (hand-over). */
#define RELIGN_SERVICE_RUN "relign.run/1"
enum {
  RELIGN_RUN_STEPS_SPENT = 0, /* it used the steps it was granted, or the trial's last ones */
  RELIGN_RUN_FINISHED = 1     /* it returned before */
};
/* Poses are commanded poses of the caller's own trial. Pointers are valid until the next call of
 * step, move or run. */
typedef struct relign_run_outcome {
  uint32_t struct_size;
  uint32_t steps; /* used of the budget */
  int32_t end;    /* RELIGN_RUN_*; meaningless unless run returned RELIGN_OK */
  uint32_t reserved;
  const relign_observation* last; /* where the stage is now, as the caller would have seen it */
  const relign_observation* best; /* lowest merit of those steps and of the pose before them, without image unless
                                     it is the last; null unless the caller is granted RELIGN_OBSERVES_MERIT */
  const double* recommendation;   /* what it would glue at; null when it gave none. It counts only when the
                                     caller repeats it by relign_trial::recommend */
} relign_run_outcome;

typedef struct relign_run_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* parameter: name of the caller's parameter that chose the algorithm. parameters_json: an object of changes to the
   * chosen one's parameters, empty text for none. The other algorithm drives a trial of its own: its step 0
   * is the last capture, its budget most_steps or what is left, its commanded coordinates count from where the
   * stage is unless both know the start, and it is granted only what both manifests know. Stage, clocks and
   * records are the caller's. RELIGN_STOP: no step was left, nothing was run. RELIGN_FAILED: the other
   * algorithm failed; outcome tells the steps it made. */
  relign_status (*run)(void* context, relign_text parameter, relign_text parameters_json, uint32_t most_steps,
                       relign_run_outcome* outcome);
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_run_service;

/* relign.model/1, needs RELIGN_OBSERVES_DESIGN: a simulator of the scene's design with the algorithm's own offsets and
 * seeds. It is independent of the instance: the same offsets, pose and seed are the same pixels in every trial.
 * Not offered where the scene is no simulator. */
#define RELIGN_SERVICE_MODEL "relign.model/1"
typedef struct relign_model_lens relign_model_lens;
typedef struct relign_model_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  relign_text scene_json; /* as relign_scene_interface::describe wrote it: axes, nominal_pose, elements, image */
  uint32_t image_width;   /* pixels */
  uint32_t image_height;
  /* offsets_json as for relign_scene_interface::mount; "{}" is the perfect lens. At most 16 lenses at a time. What is
   * not unmounted, the host unmounts when run returns. */
  relign_status (*mount)(void* context, relign_text offsets_json, relign_model_lens** made);
  /* A noisy capture into `pixels` (image_width x image_height, tightly packed, the caller's). true_pose: 0..1
   * per axis, the pose of the lens itself; there is no stage and no distortion here. `seed` is the caller's
   * choice, from a range apart from every frame of every trial. */
  relign_status (*capture)(void* context, relign_model_lens* lens, const double* true_pose, uint32_t axes,
                           uint64_t seed, float* pixels);
  /* The same without noise; RELIGN_UNSUPPORTED when the scene does not offer it. */
  relign_status (*noise_free)(void* context, relign_model_lens* lens, const double* true_pose, uint32_t axes,
                              float* pixels);
  relign_status (*unmount)(void* context, relign_model_lens* lens);
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_model_service;

/* ---- noise levels --------------------------------------------------------------------------- */

typedef struct relign_noise_level relign_noise_level;

#define RELIGN_NOISE_LEVEL_INTERFACE "relign.noise-level/1"
typedef struct relign_noise_level_interface {
  uint32_t struct_size;
  uint32_t reserved;
  relign_status (*create)(const relign_host* host, const relign_parameters* parameters, relign_noise_level** made);
  /* One draw of the perturbations W, a pure function of its arguments. scene_json is what the scene's
   * describe wrote. Writes {"start": [n values in 0..1], "distortion": [[n x n]],
   * "elements": {"L2": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}}}. */
  relign_status (*draw)(relign_noise_level* self, uint64_t seed, relign_text scene_json, const relign_text_sink* drawn);
  void (*destroy)(relign_noise_level* self);
  const void* (*get_extension)(relign_noise_level* self, relign_text id); /* may be null */
} relign_noise_level_interface;

/* ---- scenes --------------------------------------------------------------------------------- */

typedef struct relign_scene relign_scene;
typedef struct relign_assembly relign_assembly;

#define RELIGN_SCENE_INTERFACE "relign.scene/1"
/* One scene object per worker. Its assemblies are used by the thread that uses the scene, or by one
 * thread each. Images and truths are pure functions of their arguments. */
typedef struct relign_scene_interface {
  uint32_t struct_size;
  uint32_t reserved;
  relign_status (*create)(const relign_host* host, const relign_parameters* parameters, relign_scene** made);
  /* Writes one JSON object:
   * {"name": "relign_od",
   *  "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1}, ...],   pose 0..1 maps to lower..upper
   *  "nominal_pose": [0.5, ...],
   *  "image": {"width": 200, "height": 200, "white": 0.115},                white = display value of a lit pixel
   *  "elements": ["L1", ...],                                               what a noise level may offset
   *  "machine_time": {"speed_mm_per_s": 5, ...},  "spec": {...},            optional defaults for suites
   *  "files": ["/abs/path", ...],                                           data files the image depends on
   *  "summary": "..."} */
  relign_status (*describe)(relign_scene* self, const relign_text_sink* description);
  /* O*: the noise-free image of the perfect lens at the nominal pose. Valid as long as the scene. */
  relign_status (*reference)(relign_scene* self, relign_image* image);
  /* offsets_json: {"L2": {"shift_mm": [x, y, z], "tilt_deg": [rx, ry]}, ...}; "{}" is the perfect lens. */
  relign_status (*mount)(relign_scene* self, relign_text offsets_json, relign_assembly** made);
  void (*unmount)(relign_assembly* assembly);
  /* Renders a noisy capture into `pixels` (width x height, tightly packed, owned by the caller). */
  relign_status (*capture)(relign_assembly* assembly, const double* true_pose, uint32_t axes, uint64_t frame_seed,
                           float* pixels);
  /* Unbiased estimate of the noise-free MSE against O* at a true pose (may be slightly negative),
   * and its standard error. `seed` selects an own random stream, apart from all captures. */
  relign_status (*noise_free_mse)(relign_assembly* assembly, const double* true_pose, uint32_t axes, uint64_t seed,
                                  double* mse, double* standard_error);
  void (*destroy)(relign_scene* self);
  const void* (*get_extension)(relign_scene* self, relign_text id); /* may be null */
} relign_scene_interface;

/* Optional ability of a scene: a noise-free image, for pictures and reports. */
#define RELIGN_SCENE_NOISE_FREE "relign.scene.noise-free/1"
typedef struct relign_scene_noise_free {
  uint32_t struct_size;
  uint32_t reserved;
  relign_status (*render)(relign_assembly* assembly, const double* true_pose, uint32_t axes, float* pixels);
} relign_scene_noise_free;

/* Optional ability of a scene: it owns its stage. Such a scene is a station: its own hexapod and
 * camera, whose distortion and start are unknown. It says so in what describe writes:
 *   "owns_stage": true   offers this table; "nominal_pose" and "elements" may then be left out
 *   "truth": false       noise_free_mse is RELIGN_UNSUPPORTED (also allowed without a stage of one's own;
 *                        a station must say it)
 * The host then never calls mount, unmount, capture and noise_free_mse of relign_scene_interface. It
 * calls create, describe, reference and get_extension, and per trial
 *   begin, capture, then for each step: move_by, capture
 * One scene object per station and one thread at a time: the host never runs two trials of a station
 * at once. A trial may end after any call; the next one starts with begin. After a failure the
 * object is destroyed and made anew.
 * A failure is the trial's outcome, with the steps made until then; nothing is tried again: whoever
 * wants retries makes them inside. Seconds are measured machine time (travel, settling, exposure,
 * readout), finite and not negative; the host adds none of its own. */
#define RELIGN_SCENE_STAGE "relign.scene.stage/1"
typedef struct relign_stage_move {
  uint32_t struct_size;
  uint32_t reserved;
  uint64_t limits_low;    /* bit i: axis i met its lower limit during this move */
  uint64_t limits_high;   /* bit i: axis i met its upper limit */
  double machine_seconds; /* of this move, settling included */
  double* moved;          /* `axes` values of the host's, filled with the move asked for: what a limit cut, the station
                             writes here as its encoders tell it. Valid during the call */
} relign_stage_move;

typedef struct relign_scene_stage {
  uint32_t struct_size;
  uint32_t reserved;
  /* Brings the station to a start pose. Equal seeds ask for the same start (and the same lens), as
   * well as the station can; the pose stays its own secret. Its time does not count. */
  relign_status (*begin)(relign_scene* self, uint64_t seed);
  /* One move relative to where the stage is by its own encoders, in shares of the travel that describe
   * tells. A limit is no failure: stop there and say so. */
  relign_status (*move_by)(relign_scene* self, const double* delta, uint32_t axes, relign_stage_move* made);
  /* One picture from where the stage is, into `pixels` (width x height, tightly packed, owned by the caller). */
  relign_status (*capture)(relign_scene* self, float* pixels, double* machine_seconds);
} relign_scene_stage;

/* ---- the library ---------------------------------------------------------------------------- */

typedef struct relign_plugin_description {
  uint32_t struct_size;
  uint32_t abi_major;
  uint32_t abi_minor;
  uint32_t min_host_minor;
  const char* manifest_json; /* NUL-terminated; byte for byte the relign-plugin.json beside the library */
  const char* build_info;    /* NUL-terminated: compiler and its version */
  /* The table for RELIGN_*_INTERFACE ids; null for others. */
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
