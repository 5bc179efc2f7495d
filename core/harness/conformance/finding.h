// The result of one check of one plugin.
#pragma once

#include <optional>
#include <string>

namespace relign::conformance {

enum class Verdict { ok, warning, failed, skipped };

struct Finding {
  Verdict verdict = Verdict::ok;
  std::string sentence;  // message; usually empty for ok
};

inline Finding ok(std::string sentence = "") { return {Verdict::ok, std::move(sentence)}; }
inline Finding warning(std::string sentence) { return {Verdict::warning, std::move(sentence)}; }
inline Finding failed(std::string sentence) { return {Verdict::failed, std::move(sentence)}; }
inline Finding skipped(std::string sentence) { return {Verdict::skipped, std::move(sentence)}; }

const char* verdict_name(Verdict verdict);  // "ok"
std::optional<Verdict> verdict_from_name(const std::string& name);

}  // namespace relign::conformance
