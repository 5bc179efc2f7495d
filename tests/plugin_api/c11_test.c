/* relign/plugin.h as strict C11: compiles alone, and a plugin's table can be written
 * and called in plain C. */
#include <relign/plugin.h>
#include <stdio.h>
#include <string.h>

struct relign_algorithm {
  const relign_host* host;
  double stride;
};

static struct relign_algorithm only_one;

static relign_status create(const relign_host* host, const relign_parameters* parameters, relign_algorithm** made) {
  relign_text name = {"stride", 6};
  only_one.host = host;
  *made = &only_one;
  return parameters->number(parameters->context, name, &only_one.stride);
}

static relign_status run(relign_algorithm* self, const relign_trial* trial) {
  relign_text sentence = {"no trial", 15};
  (void)trial;
  self->host->fail(self->host->context, sentence);
  return RELIGN_FAILED;
}

static void destroy(relign_algorithm* self) { self->stride = 0; }

static const relign_algorithm_interface table = {sizeof(relign_algorithm_interface), 0, create, run, destroy, NULL};

static const void* get_interface(relign_text id) {
  const size_t size = strlen(RELIGN_ALGORITHM_INTERFACE);
  return id.size == size && memcmp(id.data, RELIGN_ALGORITHM_INTERFACE, size) == 0 ? &table : NULL;
}

static const relign_plugin_description entry = {
    sizeof(relign_plugin_description), RELIGN_ABI_MAJOR, RELIGN_ABI_MINOR, 0, "{}", "c11", get_interface};

static char failure[64];
static void fail(void* context, relign_text message) {
  (void)context;
  memcpy(failure, message.data, (size_t)message.size);
}

static relign_status number(void* context, relign_text name, double* value) {
  (void)context;
  if (name.size != 6 || memcmp(name.data, "stride", 6) != 0) return RELIGN_BAD_ARGUMENT;
  *value = 0.25;
  return RELIGN_OK;
}

#define REQUIRE(condition)                           \
  do {                                               \
    if (!(condition)) {                              \
      fprintf(stderr, "not true: %s\n", #condition); \
      return 1;                                      \
    }                                                \
  } while (0)

int main(void) {
  relign_host host;
  relign_parameters parameters;
  relign_algorithm* made = NULL;
  const relign_text known = {RELIGN_ALGORITHM_INTERFACE, strlen(RELIGN_ALGORITHM_INTERFACE)};
  const relign_text unknown = {RELIGN_SCENE_INTERFACE, strlen(RELIGN_SCENE_INTERFACE)};
  const relign_algorithm_interface* found;
  memset(&host, 0, sizeof host);
  memset(&parameters, 0, sizeof parameters);
  host.struct_size = sizeof host;
  host.fail = fail;
  parameters.struct_size = sizeof parameters;
  parameters.number = number;

  found = entry.get_interface(known);
  REQUIRE(found != NULL);
  REQUIRE(entry.get_interface(unknown) == NULL);
  REQUIRE(found->create(&host, &parameters, &made) == RELIGN_OK);
  REQUIRE(made != NULL && made->stride == 0.25);
  REQUIRE(found->run(made, NULL) == RELIGN_FAILED);
  REQUIRE(strcmp(failure, "no trial") == 0);
  found->destroy(made);
  REQUIRE(made->stride == 0);
  return 0;
}
