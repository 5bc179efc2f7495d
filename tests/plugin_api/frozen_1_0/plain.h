/* What the frozen plugins share. Compiled against the copy of version 1.0 alone, whose layout it pins. */
#ifndef RELIGN_TESTS_FROZEN_PLAIN_H
#define RELIGN_TESTS_FROZEN_PLAIN_H

#define RELIGN_LAYOUT_IS_EXACT
#include <relign/plugin.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "abi_layout.h"

#define FROZEN_AXES 2

extern const char relign_manifest_text[];

static inline relign_text text_of(const char* words) {
  const relign_text text = {words, strlen(words)};
  return text;
}

static inline int equals(relign_text text, const char* words) {
  return text.size == strlen(words) && memcmp(text.data, words, strlen(words)) == 0;
}

static inline relign_status fail(const relign_host* host, const char* sentence) {
  host->fail(host->context, text_of(sentence));
  return RELIGN_FAILED;
}

/* Line by line to the host's log, where the test reads it. */
static inline void tell(const relign_host* host, const char* sentence) {
  host->log(host->context, RELIGN_LOG_INFO, text_of(sentence));
}

static inline void tell_host(const relign_host* host) {
  char line[100];
  snprintf(line, sizeof line, "host %u.%u of %u bytes", (unsigned)host->abi_major, (unsigned)host->abi_minor,
           (unsigned)host->struct_size);
  tell(host, line);
}

/* A text sink into a buffer of 4000 bytes. */
typedef struct collected {
  char text[4000];
} collected;

static inline void collect(void* context, relign_text text) {
  collected* into = (collected*)context;
  const size_t size = text.size < sizeof into->text - 1 ? (size_t)text.size : sizeof into->text - 1;
  memcpy(into->text, text.data, size);
  into->text[size] = '\0';
}

static inline relign_text_sink sink_into(collected* into) {
  const relign_text_sink sink = {sizeof(relign_text_sink), 0, into, collect};
  return sink;
}

#define FROZEN_PLUGIN(interface_id, table)                                                                \
  static const void* get_interface(relign_text id) { return equals(id, interface_id) ? &(table) : NULL; } \
  RELIGN_EXPORT extern const relign_plugin_description relign_plugin_entry;                               \
  const relign_plugin_description relign_plugin_entry = {sizeof(relign_plugin_description),               \
                                                         RELIGN_ABI_MAJOR,                                \
                                                         RELIGN_ABI_MINOR,                                \
                                                         0,                                               \
                                                         relign_manifest_text,                            \
                                                         "frozen",                                        \
                                                         get_interface};

#endif
