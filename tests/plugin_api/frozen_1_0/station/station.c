/* A station of version 1.0: two axes from 0 to 1, a start at (0.25, 0.75), 0.5 s a move, 0.125 s a capture. A pixel is
 * the sum of both places. */
#include "../plain.h"

#define PIXELS 6

struct relign_scene {
  const relign_host* host;
  double place[FROZEN_AXES];
  float reference[PIXELS];
};

static relign_status create(const relign_host* host, const relign_parameters* parameters, relign_scene** made) {
  relign_scene* station = (relign_scene*)calloc(1, sizeof *station);
  (void)parameters;
  if (!station) return RELIGN_FAILED;
  station->host = host;
  tell_host(host);
  *made = station;
  return RELIGN_OK;
}

static relign_status describe(relign_scene* self, const relign_text_sink* description) {
  (void)self;
  description->write(description->context,
                     text_of("{\"name\": \"frozen station\", \"owns_stage\": true, \"truth\": false, \"axes\": ["
                             "{\"name\": \"x\", \"unit\": \"mm\", \"lower\": -1, \"upper\": 1},"
                             "{\"name\": \"y\", \"unit\": \"mm\", \"lower\": -1, \"upper\": 1}],"
                             "\"image\": {\"width\": 3, \"height\": 2, \"white\": 1}}"));
  return RELIGN_OK;
}

static relign_status reference(relign_scene* self, relign_image* image) {
  const relign_image mine = {sizeof mine, RELIGN_SAMPLE_FLOAT32, 3, 2, 1, 0, self->reference, 3 * sizeof(float)};
  *image = mine;
  return RELIGN_OK;
}

static relign_status mount(relign_scene* self, relign_text offsets_json, relign_assembly** made) {
  (void)offsets_json;
  (void)made;
  return fail(self->host, "a station mounts nothing");
}
static void unmount(relign_assembly* assembly) { (void)assembly; }
static relign_status no_capture(relign_assembly* assembly, const double* pose, uint32_t axes, uint64_t seed,
                                float* pixels) {
  (void)assembly, (void)pose, (void)axes, (void)seed, (void)pixels;
  return RELIGN_UNSUPPORTED;
}
static relign_status no_truth(relign_assembly* assembly, const double* pose, uint32_t axes, uint64_t seed, double* mse,
                              double* standard_error) {
  (void)assembly, (void)pose, (void)axes, (void)seed, (void)mse, (void)standard_error;
  return RELIGN_UNSUPPORTED;
}

static relign_status begin(relign_scene* self, uint64_t seed) {
  (void)seed;
  self->place[0] = 0.25;
  self->place[1] = 0.75;
  return RELIGN_OK;
}

static relign_status move_by(relign_scene* self, const double* delta, uint32_t axes, relign_stage_move* made) {
  if (axes != FROZEN_AXES || made->struct_size < sizeof *made) return RELIGN_BAD_ARGUMENT;
  for (int axis = 0; axis < FROZEN_AXES; ++axis) {
    const double before = self->place[axis];
    self->place[axis] += delta[axis];
    if (self->place[axis] >= 0 && self->place[axis] <= 1) continue; /* a whole move stands there already */
    if (self->place[axis] < 0)
      made->limits_low |= (uint64_t)1 << axis;
    else
      made->limits_high |= (uint64_t)1 << axis;
    self->place[axis] = self->place[axis] < 0 ? 0 : 1;
    made->moved[axis] = self->place[axis] - before;
  }
  made->machine_seconds = 0.5;
  return RELIGN_OK;
}

static relign_status capture(relign_scene* self, float* pixels, double* machine_seconds) {
  for (int i = 0; i < PIXELS; ++i) pixels[i] = (float)(self->place[0] + self->place[1]);
  *machine_seconds = 0.125;
  return RELIGN_OK;
}

static void destroy(relign_scene* self) { free(self); }

static const relign_scene_stage stage = {sizeof stage, 0, begin, move_by, capture};

static const void* get_extension(relign_scene* self, relign_text id) {
  (void)self;
  return equals(id, RELIGN_SCENE_STAGE) ? &stage : NULL;
}

static const relign_scene_interface table = {sizeof table, 0,          create,   describe, reference,    mount,
                                             unmount,      no_capture, no_truth, destroy,  get_extension};

FROZEN_PLUGIN(RELIGN_SCENE_INTERFACE, table)
