/* A noise level of version 1.0: starts at (0.25 + (seed mod 8) / 32, 0.75), no distortion, L1 shifted. */
#include "../plain.h"

struct relign_noise_level {
  const relign_host* host;
  double shift_mm;
};

static relign_status create(const relign_host* host, const relign_parameters* parameters, relign_noise_level** made) {
  relign_noise_level* level = (relign_noise_level*)malloc(sizeof *level);
  if (!level) return RELIGN_FAILED;
  level->host = host;
  tell_host(host);
  *made = level;
  return parameters->number(parameters->context, text_of("shift_mm"), &level->shift_mm);
}

static relign_status draw(relign_noise_level* self, uint64_t seed, relign_text scene_json,
                          const relign_text_sink* drawn) {
  char text[300];
  if (scene_json.size == 0) return fail(self->host, "there is no scene");
  snprintf(text, sizeof text,
           "{\"start\": [%.17g, 0.75], \"distortion\": [[1, 0], [0, 1]],"
           " \"elements\": {\"L1\": {\"shift_mm\": [%.17g, 0, 0], \"tilt_deg\": [0, 0]}}}",
           0.25 + (double)(seed % 8) / 32, self->shift_mm);
  drawn->write(drawn->context, text_of(text));
  return RELIGN_OK;
}

static void destroy(relign_noise_level* self) { free(self); }

static const relign_noise_level_interface table = {sizeof table, 0, create, draw, destroy, NULL};

FROZEN_PLUGIN(RELIGN_NOISE_LEVEL_INTERFACE, table)
