// Helpers of every service function: status codes, messages, refusals. For the files that implement services.
#pragma once

#include "base/error.h"
#include "trials/services.h"
#include "trials/trial_host.h"

namespace relign::trials {

template <class Body>
relign_status ServiceContext::answer(Body&& body) {
  if (std::this_thread::get_id() != thread) return RELIGN_BAD_ARGUMENT;
  why.clear();
  try {
    return body();
  } catch (const Error& error) {
    const bool own = error.kind() == ErrorKind::bad_input || error.kind() == ErrorKind::plugin_failed;
    if (!own || host.host_failed()) throw;
    why = error.what();
    return error.kind() == ErrorKind::bad_input ? RELIGN_BAD_ARGUMENT : RELIGN_FAILED;
  }
}

// Answers RELIGN_STOP, but RELIGN_FAILED to an algorithm that ignores it for too long.
inline relign_status stop(ServiceContext& shared) {
  const relign_status status = shared.host.refuse(RELIGN_STOP);
  shared.why = shared.host.refusal();
  return status;
}

template <class Body>
relign_status ServiceContext::answer_unless_stopped(Body&& body) {
  return answer([&]() -> relign_status { return host.stop_requested() ? stop(*this) : body(); });
}

inline std::string text_of(relign_text text) {
  return text.data ? std::string(text.data, static_cast<std::size_t>(text.size)) : std::string();
}

// The `why` of a service whose context is its ServiceContext.
inline relign_status tell_why(void* context, const relign_text_sink* sentence) {
  return write_text(sentence, static_cast<ServiceContext*>(context)->why);
}

}  // namespace relign::trials
