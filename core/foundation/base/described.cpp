#include "base/described.h"

#include "base/text.h"

namespace relign {
namespace {

bool is_word_of(std::string_view list, std::string_view word) {
  return !word.empty() && word.find(' ') == std::string_view::npos &&
         (" " + std::string(list) + " ").find(" " + std::string(word) + " ") != std::string::npos;
}

}  // namespace

void JsonFlaws::expected(const std::string& what, const Json& found) {
  add("is " + shown(found) + "; expected " + what);
}

void JsonFlaws::add(const std::string& sentence) {
  if (texts_.size() < kMost) texts_.push_back((place_.empty() ? "it" : place_) + " " + sentence);
}

std::string JsonFlaws::text() const { return join(texts_, "\n  "); }

bool read_whole(const Member& member, const Json& json, std::uint64_t most, std::uint64_t& value, JsonFlaws& flaws) {
  const auto least = member.least > 0 ? static_cast<std::uint64_t>(member.least) : 0;
  if (std::isfinite(member.most)) most = static_cast<std::uint64_t>(member.most);
  if (json.is_number_unsigned() || (json.is_number_integer() && json.get<std::int64_t>() >= 0))
    if (value = json.get<std::uint64_t>(); value >= least && value <= most) return true;
  flaws.expected(std::isfinite(member.most) ? "an integer from " + std::to_string(least) + " to " + std::to_string(most)
                                            : "an integer of at least " + std::to_string(least),
                 json);
  return false;
}

void JsonForm<double>::read(const Member& member, const Json& json, double& value, JsonFlaws& flaws) {
  if (json.is_null() && member.is(kMayBeNull)) {
    value = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  const double read = json.is_number() ? json.get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (read >= member.least && read <= member.most && !(member.is(kAboveLeast) && read == member.least)) {
    value = read;
    return;
  }
  std::string what = "a number";
  if (std::isfinite(member.least))
    what += (member.is(kAboveLeast) ? " above " : " of at least ") + shortest(member.least);
  if (std::isfinite(member.most))
    what += (std::isfinite(member.least) ? " and at most " : " of at most ") + shortest(member.most);
  flaws.expected(what, json);
}

void JsonForm<std::string>::read(const Member& member, const Json& json, std::string& value, JsonFlaws& flaws) {
  if (!json.is_string()) return flaws.expected("text", json);
  json.get_to(value);
  if (member.one_of.empty() || is_word_of(member.one_of, value)) return;
  std::string words = "'" + std::string(member.one_of) + "'";
  for (std::size_t at = 0; (at = words.find(' ', at)) != std::string::npos; at += 6) words.replace(at, 1, "' or '");
  flaws.expected(words, json);
}

void refuse_flaws(const JsonFlaws& flaws, const std::string& file) {
  if (flaws.any()) throw Error(ErrorKind::bad_input, file + " is damaged: " + flaws.text());
}

}  // namespace relign
