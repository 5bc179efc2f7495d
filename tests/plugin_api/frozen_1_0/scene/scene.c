/* A scene of version 1.0. Every pixel of column c is 0.5 + d (1 + c / 10), where d is the sum of the distances of the
 * axes from 0.5, the first one moved by the shift of L1; a capture adds the fraction (seed mod 1000) / 10^6. */
#include "../plain.h"

#define WIDTH 6
#define HEIGHT 4

struct relign_scene {
  const relign_host* host;
  float reference[WIDTH * HEIGHT];
};

struct relign_assembly {
  const relign_host* host;
  double shift;
};

static relign_status create(const relign_host* host, const relign_parameters* parameters, relign_scene** made) {
  relign_scene* scene = (relign_scene*)malloc(sizeof *scene);
  if (!scene || parameters->json.size == 0) return RELIGN_FAILED;
  scene->host = host;
  for (int i = 0; i < WIDTH * HEIGHT; ++i) scene->reference[i] = 0.5F;
  tell_host(host);
  *made = scene;
  return RELIGN_OK;
}

static relign_status describe(relign_scene* self, const relign_text_sink* description) {
  (void)self;
  description->write(description->context, text_of("{\"name\": \"frozen scene\", \"axes\": ["
                                                   "{\"name\": \"x\", \"unit\": \"mm\", \"lower\": -1, \"upper\": 1},"
                                                   "{\"name\": \"y\", \"unit\": \"mm\", \"lower\": -1, \"upper\": 1}],"
                                                   "\"nominal_pose\": [0.5, 0.5], \"elements\": [\"L1\"],"
                                                   "\"image\": {\"width\": 6, \"height\": 4, \"white\": 1}}"));
  return RELIGN_OK;
}

static relign_status reference(relign_scene* self, relign_image* image) {
  /* Never more than there is room for, never more than this version observes. */
  const relign_image mine = {sizeof mine,     RELIGN_SAMPLE_FLOAT32, WIDTH, HEIGHT, 1, 0,
                             self->reference, WIDTH * sizeof(float)};
  if (image->struct_size < sizeof mine) return RELIGN_BAD_ARGUMENT;
  *image = mine;
  return RELIGN_OK;
}

static relign_status mount(relign_scene* self, relign_text offsets_json, relign_assembly** made) {
  const char* const key = "\"shift_mm\":[";
  collected offsets;
  relign_assembly* assembly = (relign_assembly*)malloc(sizeof *assembly);
  if (!assembly) return RELIGN_FAILED;
  collect(&offsets, offsets_json);
  const char* found = strstr(offsets.text, key);
  assembly->host = self->host;
  assembly->shift = found ? strtod(found + strlen(key), NULL) : 0;
  *made = assembly;
  return RELIGN_OK;
}

static void unmount(relign_assembly* assembly) { free(assembly); }

static double distance(const relign_assembly* assembly, const double* pose) {
  double sum = 0;
  for (int axis = 0; axis < FROZEN_AXES; ++axis) {
    const double away = pose[axis] - 0.5 - (axis == 0 ? assembly->shift : 0);
    sum += away < 0 ? -away : away;
  }
  return sum;
}

static relign_status picture(const relign_assembly* assembly, const double* pose, uint32_t axes, double more,
                             float* pixels) {
  if (axes != FROZEN_AXES) return fail(assembly->host, "expected two axes");
  for (int i = 0; i < WIDTH * HEIGHT; ++i)
    pixels[i] = (float)(0.5 + more + distance(assembly, pose) * (1 + (i % WIDTH) / 10.0));
  return RELIGN_OK;
}

static relign_status capture(relign_assembly* assembly, const double* true_pose, uint32_t axes, uint64_t frame_seed,
                             float* pixels) {
  return picture(assembly, true_pose, axes, (double)(frame_seed % 1000) / 1e6, pixels);
}

static relign_status noise_free(relign_assembly* assembly, const double* true_pose, uint32_t axes, float* pixels) {
  return picture(assembly, true_pose, axes, 0, pixels);
}

static relign_status noise_free_mse(relign_assembly* assembly, const double* true_pose, uint32_t axes, uint64_t seed,
                                    double* mse, double* standard_error) {
  double sum = 0;
  (void)seed;
  if (axes != FROZEN_AXES) return fail(assembly->host, "expected two axes");
  for (int column = 0; column < WIDTH; ++column) sum += (1 + column / 10.0) * (1 + column / 10.0) / WIDTH;
  *mse = distance(assembly, true_pose) * distance(assembly, true_pose) * sum;
  *standard_error = 0;
  return RELIGN_OK;
}

static void destroy(relign_scene* self) { free(self); }

static const relign_scene_noise_free noise_free_table = {sizeof noise_free_table, 0, noise_free};

static const void* get_extension(relign_scene* self, relign_text id) {
  (void)self;
  return equals(id, RELIGN_SCENE_NOISE_FREE) ? &noise_free_table : NULL;
}

static const relign_scene_interface table = {sizeof table, 0,       create,         describe, reference,    mount,
                                             unmount,      capture, noise_free_mse, destroy,  get_extension};

FROZEN_PLUGIN(RELIGN_SCENE_INTERFACE, table)
