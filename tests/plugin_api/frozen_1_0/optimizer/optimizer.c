/* An optimizer of version 1.0: one absolute and one relative step, then another algorithm for some steps, then up and
 * down the first axis until it is stopped. Recommends the best pose it saw. */
#include "../plain.h"

struct relign_algorithm {
  const relign_host* host;
  double stride;
  int64_t hand_over;
};

static relign_status create(const relign_host* host, const relign_parameters* parameters, relign_algorithm** made) {
  int32_t eager = 0;
  relign_text then = {NULL, 0};
  relign_algorithm* mine = (relign_algorithm*)malloc(sizeof *mine);
  if (!mine) return RELIGN_FAILED;
  mine->host = host;
  *made = mine;
  tell_host(host);
  if (parameters->number(parameters->context, text_of("stride"), &mine->stride) != RELIGN_OK ||
      parameters->integer(parameters->context, text_of("hand_over"), &mine->hand_over) != RELIGN_OK ||
      parameters->boolean(parameters->context, text_of("eager"), &eager) != RELIGN_OK || !eager ||
      parameters->text(parameters->context, text_of("then"), &then) != RELIGN_OK || then.size == 0)
    return fail(host, "a parameter is missing");
  if (parameters->number(parameters->context, text_of("then"), &mine->stride) != RELIGN_BAD_ARGUMENT)
    return fail(host, "a text was taken for a number");
  return RELIGN_OK;
}

typedef struct best {
  double merit;
  double pose[FROZEN_AXES];
} best;

static void keep_best(best* kept, const relign_observation* seen) {
  if (!(seen->merit < kept->merit)) return;
  kept->merit = seen->merit;
  memcpy(kept->pose, seen->pose, sizeof kept->pose);
}

static relign_status run(relign_algorithm* self, const relign_trial* trial) {
  const relign_task* task = trial->task;
  double pose[FROZEN_AXES] = {0, 0};
  best kept = {1e300, {0, 0}};
  relign_observation seen;
  relign_status status;
  memset(&seen, 0, sizeof seen);
  seen.struct_size = sizeof seen;
  if (task->axes != FROZEN_AXES || !task->box_lower || !(task->observes & RELIGN_OBSERVES_MERIT))
    return fail(self->host, "another task than it was made for");
  if (trial->first(trial->context, &seen) != RELIGN_OK) return fail(self->host, "there is no step 0");
  keep_best(&kept, &seen);
  memcpy(pose, seen.pose, sizeof pose);
  pose[0] += self->stride;
  if (trial->step(trial->context, pose, task->axes + 1, &seen) != RELIGN_BAD_ARGUMENT)
    return fail(self->host, "three axes were taken for two");
  status = trial->step(trial->context, pose, task->axes, &seen);
  if (status == RELIGN_OK) {
    const double down[FROZEN_AXES] = {0, -self->stride};
    keep_best(&kept, &seen);
    status = trial->move(trial->context, down, task->axes, &seen);
  }
  if (status == RELIGN_OK) {
    const relign_run_service* runner =
        (const relign_run_service*)trial->get_service(trial->context, text_of(RELIGN_SERVICE_RUN));
    relign_run_outcome outcome;
    memset(&outcome, 0, sizeof outcome);
    outcome.struct_size = sizeof outcome;
    keep_best(&kept, &seen);
    if (!runner) return fail(self->host, "nobody can be run");
    status = runner->run(runner->context, text_of("then"), text_of(""), (uint32_t)self->hand_over, &outcome);
    if (status == RELIGN_OK) {
      char line[100];
      snprintf(line, sizeof line, "other steps %u end %d", (unsigned)outcome.steps, (int)outcome.end);
      tell(self->host, line);
      keep_best(&kept, outcome.best);
      memcpy(pose, outcome.last->pose, sizeof pose);
    } else if (status != RELIGN_STOP) {
      collected sentence;
      const relign_text_sink sink = sink_into(&sentence);
      runner->why(runner->context, &sink);
      return fail(self->host, sentence.text);
    }
  }
  for (int sign = 1; status == RELIGN_OK; sign = -sign) {
    pose[0] += sign * self->stride;
    status = trial->step(trial->context, pose, task->axes, &seen);
    if (status == RELIGN_OK) keep_best(&kept, &seen);
    if (trial->recommend(trial->context, kept.pose, task->axes) != RELIGN_OK)
      return fail(self->host, "no recommendation");
  }
  return status == RELIGN_STOP ? RELIGN_OK : fail(self->host, "a step was refused");
}

static void destroy(relign_algorithm* self) { free(self); }

static const relign_algorithm_interface table = {sizeof table, 0, create, run, destroy, NULL};

FROZEN_PLUGIN(RELIGN_ALGORITHM_INTERFACE, table)
