/*
 * relign/services/measures.h: "relign.measures/1", measures of the last capture, such as its sharpness. Needs
 * RELIGN_OBSERVES_IMAGES. The rules of all services are in relign/plugin.h.
 */
#ifndef RELIGN_SERVICES_MEASURES_H
#define RELIGN_SERVICES_MEASURES_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The slanted edges of the last capture, field by field, in the order of the scene's "fields". Arrays have
 * `count` values and are valid until the next call of `fields`. NaN: not in this capture. */
typedef struct relign_field_measures {
  uint32_t struct_size;
  uint32_t count;
  const relign_text* names;
  const double* mark_x_px;  /* centre of the field's mark, from the middle of the first column */
  const double* mark_y_px;  /* from the middle of the top row */
  const double* tangential; /* MTF, pixel included */
  const double* sagittal;
} relign_field_measures;

#define RELIGN_SERVICE_MEASURES "relign.measures/1"
typedef struct relign_measures_service {
  uint32_t struct_size;
  uint32_t reserved;
  void* context;
  /* Writes [{"name": "mtf", "summary": "...", "arguments": {"cycles_per_pixel": "...", ...}}, ...]; a summary states
   * the unit. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*list)(void* context, const relign_text_sink* measures);
  /* Writes one measure of the last capture. arguments_json: an object; empty text is "{}". The value is NaN when this
   * capture does not allow the measure (no light, no edge in the region); that is not a failure. RELIGN_BAD_ARGUMENT:
   * an unknown measure, or arguments that it does not take. [run-thread] */
  relign_status (*measure)(void* context, relign_text name, relign_text arguments_json, double* value);
  /* Writes why the last service function of this trial failed. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*why)(void* context, const relign_text_sink* sentence);
  /* Writes all fields at once, in the time of one measure of a field. arguments_json: {"cycles_per_pixel": ...} or
   * {"lp_per_mm": ...}. Writes `fields`, up to its struct_size. RELIGN_BAD_ARGUMENT: other arguments, or a scene
   * without fields. [run-thread] */
  relign_status (*fields)(void* context, relign_text arguments_json, relign_field_measures* fields);
} relign_measures_service;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SERVICES_MEASURES_H */
