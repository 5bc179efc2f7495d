// How every function of a service answers; for the files that implement services.
#pragma once

#include "base/error.h"
#include "trials/conversation.h"
#include "trials/services.h"

namespace relign::trials {

template <class Body>
relign_status ServiceSite::answer(Body&& body) {
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

// RELIGN_STOP, and RELIGN_FAILED for whoever does not heed it for ever.
inline relign_status stop(ServiceSite& site) {
  const relign_status status = site.host.refuse(RELIGN_STOP);
  site.why = site.host.refusal();
  return status;
}

template <class Body>
relign_status ServiceSite::answer_unless_stopped(Body&& body) {
  return answer([&]() -> relign_status { return host.asked_to_stop() ? stop(*this) : body(); });
}

inline std::string text_of(relign_text text) {
  return text.data ? std::string(text.data, static_cast<std::size_t>(text.size)) : std::string();
}

// The `why` of a service whose context is its site.
inline relign_status tell_why(void* context, const relign_text_sink* sentence) {
  return write_text(sentence, static_cast<ServiceSite*>(context)->why);
}

}  // namespace relign::trials
