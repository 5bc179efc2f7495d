#include <algorithm>
#include <cmath>
#include <utility>

#include "base/json_source.h"
#include "base/text.h"

namespace relign {

std::string pointer_word(const std::string& key) {
  std::string out;
  for (const char letter : key) {
    if (letter == '~')
      out += "~0";
    else if (letter == '/')
      out += "~1";
    else
      out += letter;
  }
  return out;
}

ObjectReader::ObjectReader(const JsonSource& source, std::string pointer, std::vector<Problem>& problems)
    : source_(source), pointer_(std::move(pointer)), problems_(problems) {
  const Json* found = nullptr;
  const Json::json_pointer place(pointer_);
  if (source.root().contains(place) || pointer_.empty()) found = &source.root().at(place);
  if (found && found->is_object())
    object_ = found;
  else if (found)
    problems_.push_back(source_.problem(pointer_, std::string("expected an object, found ") + found->type_name()));
}

bool ObjectReader::has(const std::string& key) const { return object_ && object_->contains(key); }

std::string ObjectReader::pointer_to(const std::string& key) const { return pointer_ + "/" + pointer_word(key); }

void ObjectReader::complain(const std::string& key, const std::string& message) {
  problems_.push_back(source_.problem(key.empty() ? pointer_ : pointer_to(key), message));
}

void ObjectReader::complain_missing(const std::string& key, const std::string& expected) {
  complain("", "missing key '" + key + "' (" + expected + ")");
}

const Json* ObjectReader::get(const std::string& key) {
  known_.push_back(key);
  if (!has(key)) return nullptr;
  return &object_->at(key);
}

const Json* ObjectReader::member(const std::string& key, const char* type, bool required) {
  const Json* value = get(key);
  if (!value && required && object_) complain_missing(key, type);
  return value;
}

std::string shown(const Json& value) {
  std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

namespace {

std::string range_text(double minimum, double maximum) {
  if (std::isinf(minimum) && std::isinf(maximum)) return "a number";
  if (std::isinf(maximum)) return "a number of at least " + shortest(minimum);
  if (std::isinf(minimum)) return "a number of at most " + shortest(maximum);
  return "a number from " + shortest(minimum) + " to " + shortest(maximum);
}

}  // namespace

double ObjectReader::number(const std::string& key, double fallback, double minimum, double maximum) {
  const Json* value = member(key, "number", false);
  if (!value) return fallback;
  if (!value->is_number() || !(value->get<double>() >= minimum && value->get<double>() <= maximum)) {
    complain(key, "expected " + range_text(minimum, maximum) + ", found " + shown(*value));
    return fallback;
  }
  return value->get<double>();
}

double ObjectReader::required_number(const std::string& key, double minimum, double maximum) {
  const Json* value = member(key, "number", true);
  return value ? number(key, minimum, minimum, maximum) : 0.0;
}

std::int64_t ObjectReader::integer(const std::string& key, std::int64_t fallback, std::int64_t minimum,
                                   std::int64_t maximum) {
  const Json* value = member(key, "integer", false);
  if (!value) return fallback;
  const bool fits = value->is_number_integer() &&
                    (!value->is_number_unsigned() || value->get<std::uint64_t>() <= std::uint64_t{INT64_MAX}) &&
                    value->get<std::int64_t>() >= minimum && value->get<std::int64_t>() <= maximum;
  if (!fits) {
    complain(key, "expected an integer from " + std::to_string(minimum) + " to " + std::to_string(maximum) +
                      ", found " + shown(*value));
    return fallback;
  }
  return value->get<std::int64_t>();
}

std::string ObjectReader::string(const std::string& key, const std::string& fallback) {
  const Json* value = member(key, "string", false);
  if (!value) return fallback;
  if (!value->is_string()) {
    complain(key, "expected a string, found " + shown(*value));
    return fallback;
  }
  return value->get<std::string>();
}

std::string ObjectReader::required_string(const std::string& key) {
  return member(key, "string", true) ? string(key, "") : "";
}

bool ObjectReader::boolean(const std::string& key, bool fallback) {
  const Json* value = member(key, "true or false", false);
  if (!value) return fallback;
  if (!value->is_boolean()) {
    complain(key, "expected true or false, found " + shown(*value));
    return fallback;
  }
  return value->get<bool>();
}

std::vector<double> ObjectReader::numbers(const std::string& key, std::size_t count,
                                          const std::vector<double>& fallback) {
  const Json* value = member(key, "list of numbers", false);
  if (!value) return fallback;
  const bool fits = value->is_array() && value->size() == count &&
                    std::all_of(value->begin(), value->end(), [](const Json& item) { return item.is_number(); });
  if (!fits) {
    complain(key, "expected a list of " + std::to_string(count) + " numbers, found " + shown(*value));
    return fallback;
  }
  return value->get<std::vector<double>>();
}

void ObjectReader::reject_unknown() {
  if (!object_) return;
  std::vector<std::string> once;  // a key may have been read twice
  for (const std::string& key : known_)
    if (std::find(once.begin(), once.end(), key) == once.end()) once.push_back(key);
  known_ = std::move(once);
  for (const auto& [key, value] : object_->items()) {
    if (key == "$schema" || std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    complain(key, "unknown key '" + key + "'" + suggestion(key, known_));
  }
}

}  // namespace relign
