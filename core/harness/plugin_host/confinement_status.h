// How relign-sandbox ends when the plugin did not end by itself. A plugin's own exit status is passed on, except for
// kEndedBySandbox, so that a plugin cannot forge it.
#pragma once

namespace relign::plugin_host {

inline constexpr int kEndedBySandbox = 123;  // the last line on stderr is the prefix and the reason
inline constexpr int kCannotConfine = 125;
inline constexpr const char* kEndedPrefix = "ended by the sandbox: ";

}  // namespace relign::plugin_host
