// Helpers of every service function: status codes, messages, refusals. For the files that implement services.
#pragma once

#include "base/error.h"
#include "trials/services.h"
#include "trials/trial_host.h"

namespace relign::trials {

// Runs the body of one service function, body(ServiceContext&), which returns a status. Error(bad_input) becomes
// RELIGN_BAD_ARGUMENT and Error(plugin_failed) RELIGN_FAILED, with the message in `why`; other exceptions propagate and
// end the trial.
template <class Body>
relign_status answer(void* context, Body&& body) {
  ServiceContext& shared = *static_cast<ServiceContext*>(context);
  if (std::this_thread::get_id() != shared.thread) return RELIGN_BAD_ARGUMENT;
  shared.why.clear();
  try {
    return body(shared);
  } catch (const Error& error) {
    const bool own = error.kind() == ErrorKind::bad_input || error.kind() == ErrorKind::plugin_failed;
    if (!own || shared.host.host_failed()) throw;
    shared.why = error.what();
    return error.kind() == ErrorKind::bad_input ? RELIGN_BAD_ARGUMENT : RELIGN_FAILED;
  }
}

// Answers RELIGN_STOP, but RELIGN_FAILED to an algorithm that ignores it for too long.
inline relign_status stop(ServiceContext& shared) {
  const relign_status status = shared.host.refuse(RELIGN_STOP);
  shared.why = shared.host.refusal();
  return status;
}

// As answer, for work that may take long: returns RELIGN_STOP instead once the user has stopped the run.
template <class Body>
relign_status answer_unless_stopped(void* context, Body&& body) {
  return answer(context, [&](ServiceContext& shared) -> relign_status {
    return shared.host.stop_requested() ? stop(shared) : body(shared);
  });
}

inline std::string text_of(relign_text text) {
  return text.data ? std::string(text.data, static_cast<std::size_t>(text.size)) : std::string();
}

}  // namespace relign::trials
