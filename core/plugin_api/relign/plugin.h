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
 *  - Every struct starts with `struct_size`, set by whoever fills it. Structs only ever grow at
 *    their end; a reader never touches members beyond the writer's struct_size.
 *  - A plugin library exports one data symbol, `relign_plugin_entry`. Nothing runs at load.
 *    Libraries are never unloaded.
 *  - Major versions must be equal and the plugin's `min_host_minor` at most the host's minor.
 *    While the major version is 0 the minor must be equal as well: anything may still change.
 *  - Whoever creates an object destroys it, through its own table. The other side copies what it
 *    keeps. Views (relign_text, relign_image, arrays) are borrowed: each function says for how long.
 *  - Functions never throw and never unwind. They return a relign_status; before returning a
 *    failure a plugin may call host->fail with a sentence for the user.
 *  - RELIGN_STOP is no failure: the budget is spent or the user stopped the run. Return promptly.
 *  - Threads: one object is used by one thread at a time; different objects may be used by
 *    different threads at once. Exceptions are said at the function.
 *  - A plugin leaves floating-point mode, locale, working directory, signal handlers and stdout
 *    as it found them.
 */
#ifndef RELIGN_PLUGIN_H
#define RELIGN_PLUGIN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_ABI_MAJOR 0
#define RELIGN_ABI_MINOR 1

/* ---- plain types ------------------------------------------------------------------------ */

typedef int32_t relign_status;
enum {
  RELIGN_OK = 0,           /* done */
  RELIGN_STOP = 1,         /* budget spent or run stopped: return promptly, not an error */
  RELIGN_FAILED = -1,      /* could not be done; host->fail has the sentence */
  RELIGN_BAD_ARGUMENT = -2, /* the caller broke a rule stated here (wrong number of axes, NaN) */
  RELIGN_UNSUPPORTED = -3  /* this object does not offer what was asked for */
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
  RELIGN_KNOWS_IMAGES = 1 << 0, /* pixels of each capture */
  RELIGN_KNOWS_MERIT = 1 << 1,  /* a scalar per capture, smaller is better */
  RELIGN_KNOWS_START = 1 << 2,  /* the true start pose: commanded coordinates are the stage's own, nominal pose 0.5 */
  RELIGN_KNOWS_BOX = 1 << 3,    /* the box to search */
  RELIGN_KNOWS_DESIGN = 1 << 4, /* the scene's design */
  RELIGN_KNOWS_LEVEL = 1 << 5   /* the noise level's distribution */
};

/* The frame of one trial. Valid during run. */
typedef struct relign_task {
  uint32_t struct_size;
  uint32_t axes;   /* degrees of freedom, 1 to 64 */
  uint32_t budget; /* steps granted after step 0 */
  uint32_t knows;  /* RELIGN_KNOWS_* bits that this trial grants */
  uint64_t seed;   /* the algorithm's own seed: same seed, same trial */
  const double* box_lower; /* axes values each, commanded coordinates; null unless RELIGN_KNOWS_BOX */
  const double* box_upper;
  double largest_move; /* per axis and step, share of the travel; infinity when unlimited. Longer moves are cut */
  uint32_t image_width;  /* pixels; 0 unless RELIGN_KNOWS_IMAGES */
  uint32_t image_height;
  relign_text axes_json; /* [{"name": "x", "unit": "mm", "travel": 2.0}, ...]: travel = length of [0, 1] */
} relign_task;

/* One step: a move and the capture after it. Filled by the host; pointers are valid until the
 * next first, step or move of the same conversation. */
typedef struct relign_observation {
  uint32_t struct_size;
  uint32_t step;         /* 0 = the capture at the start pose */
  const double* pose;    /* commanded pose, task->axes values. Counts from the start pose (all 0)
                            unless RELIGN_KNOWS_START */
  double merit;          /* NaN unless RELIGN_KNOWS_MERIT */
  uint64_t limits_low;   /* bit i: axis i met its lower limit during this move */
  uint64_t limits_high;  /* bit i: axis i met its upper limit */
  const relign_image* image; /* null unless RELIGN_KNOWS_IMAGES */
  double machine_seconds;    /* simulated machine time since the start */
} relign_observation;

/* The host's side of one trial. Use from the thread that called run, during run. */
typedef struct relign_conversation {
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
  /* Optional services by string id, null when not offered. None is defined in this version. */
  const void* (*get_service)(void* context, relign_text id);
} relign_conversation;

typedef struct relign_algorithm relign_algorithm;

#define RELIGN_ALGORITHM_INTERFACE "relign.algorithm/1"
typedef struct relign_algorithm_interface {
  uint32_t struct_size;
  uint32_t reserved;
  relign_status (*create)(const relign_host* host, const relign_parameters* parameters, relign_algorithm** made);
  /* Drives one whole trial. Called once per object. Returning RELIGN_OK before a RELIGN_STOP was
   * seen declares the trial finished: the recommendation is carried forward. */
  relign_status (*run)(relign_algorithm* self, const relign_conversation* talk);
  void (*destroy)(relign_algorithm* self);
  const void* (*get_extension)(relign_algorithm* self, relign_text id); /* may be null */
} relign_algorithm_interface;

/* ---- noise levels --------------------------------------------------------------------------- */

typedef struct relign_noise_level relign_noise_level;

#define RELIGN_NOISE_LEVEL_INTERFACE "relign.noise-level/1"
typedef struct relign_noise_level_interface {
  uint32_t struct_size;
  uint32_t reserved;
  relign_status (*create)(const relign_host* host, const relign_parameters* parameters, relign_noise_level** made);
  /* One draw of the variances W, a pure function of its arguments. scene_json is what the scene's
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
