/* An agent of version 1.0: asks every service that it is offered and tells what they say, then two relative moves. */
#include "../plain.h"

struct relign_algorithm {
  const relign_host* host;
};

static relign_status create(const relign_host* host, const relign_parameters* parameters, relign_algorithm** made) {
  relign_algorithm* mine = (relign_algorithm*)malloc(sizeof *mine);
  (void)parameters;
  if (!mine) return RELIGN_FAILED;
  mine->host = host;
  *made = mine;
  return RELIGN_OK;
}

static relign_status ask_images(const relign_host* host, const relign_trial* trial) {
  const relign_reference_service* wanted =
      (const relign_reference_service*)trial->get_service(trial->context, text_of(RELIGN_SERVICE_REFERENCE));
  const relign_measures_service* measures =
      (const relign_measures_service*)trial->get_service(trial->context, text_of(RELIGN_SERVICE_MEASURES));
  collected words;
  const relign_text_sink sink = sink_into(&words);
  double mean = 0;
  char line[100];
  if (!wanted || !measures) return fail(host, "images without their services");
  if (measures->list(measures->context, &sink) != RELIGN_OK || !strstr(words.text, "\"mean\""))
    return fail(host, "there is no mean");
  if (measures->measure(measures->context, text_of("beauty"), text_of(""), &mean) != RELIGN_BAD_ARGUMENT ||
      measures->why(measures->context, &sink) != RELIGN_OK || !strstr(words.text, "beauty"))
    return fail(host, "beauty was measured");
  if (measures->measure(measures->context, text_of("mean"), text_of(""), &mean) != RELIGN_OK)
    return fail(host, "the mean was not measured");
  snprintf(line, sizeof line, "reference %.4f mean %.4f", (double)wanted->image->pixels[0], mean);
  tell(host, line);
  return RELIGN_OK;
}

static relign_status ask_level(const relign_host* host, const relign_trial* trial) {
  const relign_prior_service* prior =
      (const relign_prior_service*)trial->get_service(trial->context, text_of(RELIGN_SERVICE_PRIOR));
  collected words;
  const relign_text_sink sink = sink_into(&words);
  if (!prior) return RELIGN_OK; /* on a station */
  if (prior->draw(prior->context, 7, &sink) != RELIGN_OK) return fail(host, "the prior draws nothing");
  tell(host, strstr(words.text, "0.03125") ? "prior observes the shift" : words.text);
  return RELIGN_OK;
}

static relign_status ask_design(const relign_host* host, const relign_trial* trial) {
  const relign_model_service* model =
      (const relign_model_service*)trial->get_service(trial->context, text_of(RELIGN_SERVICE_MODEL));
  const double pose[FROZEN_AXES] = {0.625, 0.5};
  float noisy[24], clean[24];
  relign_model_lens* lens = NULL;
  char line[100];
  if (!model) return RELIGN_OK; /* on a station */
  if (model->image_width * model->image_height != 24 || model->scene_json.size == 0)
    return fail(host, "there is no model");
  if (model->mount(model->context, text_of("{}"), &lens) != RELIGN_OK ||
      model->capture(model->context, lens, pose, FROZEN_AXES, 5, noisy) != RELIGN_OK ||
      model->noise_free(model->context, lens, pose, FROZEN_AXES, clean) != RELIGN_OK ||
      model->unmount(model->context, lens) != RELIGN_OK)
    return fail(host, "the model shows nothing");
  if (noisy[0] - clean[0] < -1e-6F || noisy[0] - clean[0] > 1e-3F) return fail(host, "the model's noise is another");
  snprintf(line, sizeof line, "model %.4f", (double)clean[0]);
  tell(host, line);
  return RELIGN_OK;
}

static relign_status run(relign_algorithm* self, const relign_trial* trial) {
  const uint32_t observes = trial->task->observes;
  const double delta[FROZEN_AXES] = {0.125, -0.125};
  relign_observation seen;
  relign_status status = RELIGN_OK;
  memset(&seen, 0, sizeof seen);
  seen.struct_size = sizeof seen;
  if (trial->first(trial->context, &seen) != RELIGN_OK) return fail(self->host, "there is no step 0");
  if ((observes & RELIGN_OBSERVES_IMAGES) && seen.image->pixels[0] <= 0) return fail(self->host, "it is dark");
  if (observes & RELIGN_OBSERVES_IMAGES) status = ask_images(self->host, trial);
  if (status == RELIGN_OK && (observes & RELIGN_OBSERVES_LEVEL)) status = ask_level(self->host, trial);
  if (status == RELIGN_OK && (observes & RELIGN_OBSERVES_DESIGN)) status = ask_design(self->host, trial);
  for (int i = 0; status == RELIGN_OK && i < 2; ++i) status = trial->move(trial->context, delta, FROZEN_AXES, &seen);
  return status == RELIGN_STOP ? RELIGN_OK : status;
}

static void destroy(relign_algorithm* self) { free(self); }

static const relign_algorithm_interface table = {sizeof table, 0, create, run, destroy, NULL};

FROZEN_PLUGIN(RELIGN_ALGORITHM_INTERFACE, table)
