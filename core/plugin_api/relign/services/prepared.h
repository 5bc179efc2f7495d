/*
 * relign/services/prepared.h: "relign.prepared/1": what the algorithm learnt in pretraining. Offered if the
 * manifest declares "prepare". The rules of all services are in relign/plugin.h.
 *
 * For pretraining the host first runs one trial per *source instance*: drawn from the same noise level, for the same
 * scene and protocol, with separate seeds, so that no source is the instance of any trial. In it `active` is 1; the
 * algorithm moves, observes and saves what it needs. Its steps there are not a result. Sources are run one after the
 * other, from 0 to sources - 1, each with a new object and its own budget and seed. Trials load what was saved last.
 */
#ifndef RELIGN_SERVICES_PREPARED_H
#define RELIGN_SERVICES_PREPARED_H

#include "../types.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RELIGN_SERVICE_PREPARED "relign.prepared/1"
typedef struct relign_pretraining_service {
  uint32_t struct_size;
  uint32_t active; /* 1: on a source instance. 0: in a benchmark trial */
  void* context;
  uint32_t source;  /* on a source instance: number of this source; else 0 */
  uint32_t sources; /* on a source instance: how many there are; else 0 */
  /* Writes the bytes saved last: in a trial the pretrained data, on a source instance what the sources before saved.
   * They come from a file that anyone may have modified: check them. RELIGN_UNSUPPORTED: there are none (the first
   * source; a station; an algorithm whose parameters were changed by the one that runs it). RELIGN_FAILED: the
   * pretraining failed. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*load)(void* context, const relign_text_sink* data);
  /* Replaces the saved bytes (any, not only text; at most 1 GiB). RELIGN_BAD_ARGUMENT: in a trial, or too many.
   * [run-thread] */
  relign_status (*save)(void* context, relign_text data);
  /* Writes why the last service function of this trial failed. RELIGN_BAD_ARGUMENT: no sink. [run-thread] */
  relign_status (*why)(void* context, const relign_text_sink* sentence);
} relign_pretraining_service;

#ifdef __cplusplus
}
#endif

#endif /* RELIGN_SERVICES_PREPARED_H */
