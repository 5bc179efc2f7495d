#include "base/json_source.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "base/files.h"
#include "base/text.h"

namespace relign {
namespace {

// Reads characters for nlohmann's parser and counts them: the parser has read a token (and for
// numbers one character more) when it reports it, so the token's start is the first character
// after the previous token that is neither space nor separator.
struct CountingIterator {
  using difference_type = std::ptrdiff_t;
  using value_type = char;
  using pointer = const char*;
  using reference = const char&;
  using iterator_category = std::input_iterator_tag;

  const char* at = nullptr;
  std::size_t* read = nullptr;

  reference operator*() const { return *at; }
  CountingIterator& operator++() {
    ++at;
    if (read) ++*read;
    return *this;
  }
  bool operator==(const CountingIterator& other) const { return at == other.at; }
  bool operator!=(const CountingIterator& other) const { return at != other.at; }
};

std::pair<int, int> line_and_column(const std::string& text, std::size_t offset) {
  offset = std::min(offset, text.size());
  const auto begin = text.begin();
  const auto place = begin + static_cast<std::ptrdiff_t>(offset);
  const int line = 1 + static_cast<int>(std::count(begin, place, '\n'));
  const std::size_t previous = offset == 0 ? std::string::npos : text.rfind('\n', offset - 1);
  const std::size_t column = previous == std::string::npos ? offset + 1 : offset - previous;
  return {line, static_cast<int>(column)};
}

std::string escaped(const std::string& key) {
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

constexpr std::uintmax_t kLargestFile = std::uintmax_t{256} << 20U;
constexpr std::size_t kDeepest = 200;  // nesting; no file of ours comes near

// Builds the document and the table of offsets from the parser's events.
class Builder : public nlohmann::json_sax<Json> {
 public:
  Builder(const std::string& text, const std::size_t& read, std::map<std::string, std::size_t>& offsets)
      : text_(text), read_(read), offsets_(offsets) {}

  Json root;
  std::string error;  // empty: none
  std::size_t error_offset = 0;

  bool null() override { return value(nullptr); }
  bool boolean(bool v) override { return value(v); }
  bool number_integer(number_integer_t v) override { return value(v); }
  bool number_unsigned(number_unsigned_t v) override { return value(v); }
  bool number_float(number_float_t v, const string_t&) override { return value(v); }
  bool string(string_t& v) override { return value(v); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    const std::size_t start = token_start();
    Level& level = levels_.back();
    if (level.value->contains(name)) {
      error = "the key \"" + name + "\" stands twice in one object";
      error_offset = start;
      return false;
    }
    level.key = name;
    return true;
  }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception& problem) override {
    error = problem.what();
    // "[json.exception.parse_error.101] parse error at line 3, column 5: syntax error ..." -> the last part
    if (const auto colon = error.find(": "); colon != std::string::npos) error = error.substr(colon + 2);
    error_offset = position == 0 ? 0 : position - 1;
    return false;
  }

 private:
  struct Level {
    Json* value;
    std::string pointer;
    std::string key;
  };

  std::size_t token_start() {
    std::size_t start = previous_end_;
    while (start < text_.size() && std::string_view(" \t\r\n,:]}").find(text_[start]) != std::string_view::npos)
      ++start;
    previous_end_ = std::min(read_, text_.size());
    // A number is reported after one character too many was read.
    while (previous_end_ > start + 1 &&
           std::string_view(" \t\r\n,:]}").find(text_[previous_end_ - 1]) != std::string_view::npos)
      --previous_end_;
    return start;
  }
  Json* place(Json&& fresh) {
    const std::size_t start = token_start();
    if (levels_.empty()) {
      root = std::move(fresh);
      offsets_[""] = start;
      pointer_ = "";
      return &root;
    }
    Level& level = levels_.back();
    if (level.value->is_array()) {
      pointer_ = level.pointer + "/" + std::to_string(level.value->size());
      level.value->push_back(std::move(fresh));
      offsets_[pointer_] = start;
      return &level.value->back();
    }
    pointer_ = level.pointer + "/" + escaped(level.key);
    offsets_[pointer_] = start;
    return &((*level.value)[level.key] = std::move(fresh));
  }
  bool value(Json fresh) {
    place(std::move(fresh));
    return true;
  }
  bool open(Json fresh) {
    if (levels_.size() >= kDeepest) {
      error = "nested deeper than " + std::to_string(kDeepest) + " levels";
      error_offset = previous_end_;
      return false;
    }
    Json* placed = place(std::move(fresh));
    levels_.push_back({placed, pointer_, ""});
    return true;
  }
  bool close() {
    levels_.pop_back();
    previous_end_ = std::min(read_, text_.size());
    return true;
  }

  const std::string& text_;
  const std::size_t& read_;
  std::map<std::string, std::size_t>& offsets_;
  std::vector<Level> levels_;
  std::string pointer_;
  std::size_t previous_end_ = 0;
};

}  // namespace

JsonSource JsonSource::from_file(const std::filesystem::path& path) {
  std::error_code code;
  if (const std::uintmax_t size = std::filesystem::file_size(path, code); !code && size > kLargestFile)
    throw Error(ErrorKind::bad_input, path.string() + " has " + std::to_string(size >> 20U) +
                                          " MB; JSON files of this program have at most " +
                                          std::to_string(kLargestFile >> 20U));
  return from_text(read_file(path), path.string());
}

JsonSource JsonSource::from_text(std::string text, std::string file_name) {
  JsonSource source;
  source.file_ = std::move(file_name);
  source.text_ = std::move(text);
  std::size_t read = 0;
  Builder builder(source.text_, read, source.offsets_);
  const char* begin = source.text_.data();
  const bool parsed =
      Json::sax_parse(CountingIterator{begin, &read}, CountingIterator{begin + source.text_.size(), nullptr}, &builder);
  if (!parsed) {
    Problem problem;
    problem.file = source.file_;
    std::tie(problem.line, problem.column) = line_and_column(source.text_, builder.error_offset);
    problem.message = "this is no valid JSON: " + builder.error;
    throw_if_any({problem});
  }
  source.root_ = std::move(builder.root);
  return source;
}

Problem JsonSource::problem(const std::string& pointer, const std::string& message) const {
  Problem problem;
  problem.file = file_;
  problem.pointer = pointer;
  problem.message = message;
  // The nearest enclosing value whose place is known.
  std::string where = pointer;
  while (true) {
    if (const auto found = offsets_.find(where); found != offsets_.end()) {
      std::tie(problem.line, problem.column) = line_and_column(text_, found->second);
      break;
    }
    const auto slash = where.rfind('/');
    if (slash == std::string::npos) break;
    where.resize(slash);
  }
  return problem;
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

std::string ObjectReader::pointer_to(const std::string& key) const { return pointer_ + "/" + escaped(key); }

void ObjectReader::complain(const std::string& key, const std::string& message) {
  problems_.push_back(source_.problem(key.empty() ? pointer_ : pointer_to(key), message));
}

const Json* ObjectReader::get(const std::string& key) {
  known_.push_back(key);
  if (!has(key)) return nullptr;
  return &object_->at(key);
}

const Json* ObjectReader::member(const std::string& key, const char* type, bool required) {
  const Json* value = get(key);
  if (!value && required && object_) complain("", "the key \"" + key + "\" is missing (" + type + ")");
  return value;
}

namespace {

std::string shown(const Json& value) {
  std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

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
  const Json* value = member(key, "text", false);
  if (!value) return fallback;
  if (!value->is_string()) {
    complain(key, "expected a text, found " + shown(*value));
    return fallback;
  }
  return value->get<std::string>();
}

std::string ObjectReader::required_string(const std::string& key) {
  return member(key, "text", true) ? string(key, "") : "";
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

void ObjectReader::refuse_unknown() {
  if (!object_) return;
  for (const auto& [key, value] : object_->items()) {
    if (key == "$schema" || std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    complain(key, "unknown key \"" + key + "\"" + suggestion(key, known_));
  }
}

std::string canonical_json(const Json& value) { return value.dump(); }

}  // namespace relign
