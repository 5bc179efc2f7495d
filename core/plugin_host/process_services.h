// Services of a conversation (relign/plugin.h) as requests of a process: those whose arguments and
// results are JSON. docs/process_plugins.md lists them.
#pragma once

#include <relign/plugin.h>

#include "base/json_source.h"

namespace relign::plugin_host {

// The answer to a request {"message": "service", "service": id, "call": function, ...}: a message "result",
// "refused", "failed" or "unsupported". Throws what the service throws.
Json answer_service_request(const Json& request, const relign_conversation& talk);

}  // namespace relign::plugin_host
