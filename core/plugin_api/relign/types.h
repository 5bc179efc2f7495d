/*
 * relign/types.h: the plain types of the plugin interface, which all its C headers use. relign/plugin.h includes it and
 * has the rules.
 */
#ifndef RELIGN_TYPES_H
#define RELIGN_TYPES_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef int32_t relign_status;
enum {
  RELIGN_OK = 0,            /* done */
  RELIGN_STOP = 1,          /* budget spent or run stopped: return promptly, not an error */
  RELIGN_FAILED = -1,       /* could not be done; host->fail or relign_trial::why has the message */
  RELIGN_BAD_ARGUMENT = -2, /* the caller broke a rule of this interface (wrong number of axes, NaN) */
  RELIGN_UNSUPPORTED = -3   /* this object does not offer what was requested */
};

/* UTF-8, not necessarily NUL-terminated. data may be null when size is 0. */
typedef struct relign_text {
  const char* data;
  uint64_t size; /* bytes */
} relign_text;

/* Receives one text. */
typedef struct relign_text_sink {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* Copies `text` before it returns. Call it at most once. Cannot fail. Only in the thread of the call that got the
   * sink, and during that call. */
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
  const float* pixels;       /* height rows of width values */
  uint64_t row_stride_bytes; /* from one row to the next */
} relign_image;

/* Objects of a plugin. Only the plugin knows what is behind these pointers. */
typedef struct relign_algorithm relign_algorithm;
typedef struct relign_noise_level relign_noise_level;
typedef struct relign_scene relign_scene;
typedef struct relign_assembly relign_assembly; /* a lens as built, mounted in a scene */

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_TYPES_H */
