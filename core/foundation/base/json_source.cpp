#include "base/json_source.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "base/fault.h"
#include "base/files.h"
#include "base/json_places.h"

namespace relign {
namespace {

// Reads characters for nlohmann's parser and counts them. The parser reports a token after reading it
// (and, for numbers, one more character), so the token starts at the first character after the previous
// token that is neither space nor separator.
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

constexpr std::size_t kLargestFile = std::size_t{256} << 20U;

// Builds the document and the tree of offsets from the parser's events.
class Builder : public nlohmann::json_sax<Json> {
 public:
  Builder(const std::string& text, const std::size_t& read, JsonPlace& places)
      : text_(text), read_(read), places_(places) {}

  Json root;
  std::string error;  // empty if none
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
      error = "duplicate key '" + name + "'";
      error_offset = start;
      return false;
    }
    level.key = name;
    return true;
  }
  bool parse_error(std::size_t position, const std::string&, const nlohmann::detail::exception& problem) override {
    error = syntax_fault(problem.what());
    error_offset = position == 0 ? 0 : position - 1;
    return false;
  }

 private:
  struct Level {
    Json* value;
    JsonPlace::Inner* places;
    std::string key;
  };

  std::size_t token_start() {
    std::size_t start = previous_end_;
    while (start < text_.size() && std::string_view(" \t\r\n,:]}").find(text_[start]) != std::string_view::npos)
      ++start;
    previous_end_ = std::min(read_, text_.size());
    while (previous_end_ > start + 1 &&
           std::string_view(" \t\r\n,:]}").find(text_[previous_end_ - 1]) != std::string_view::npos)
      --previous_end_;
    return start;
  }
  std::pair<Json*, JsonPlace*> place(Json&& fresh) {
    JsonPlace begins{token_start(), nullptr};
    if (levels_.empty()) {
      root = std::move(fresh);
      places_ = std::move(begins);
      return {&root, &places_};
    }
    Level& level = levels_.back();
    if (level.value->is_array()) {
      level.value->push_back(std::move(fresh));
      level.places->items.push_back(std::move(begins));
      return {&level.value->back(), &level.places->items.back()};
    }
    JsonPlace& member = level.places->members[level.key] = std::move(begins);
    return {&((*level.value)[level.key] = std::move(fresh)), &member};
  }
  bool value(Json fresh) {
    place(std::move(fresh));
    return true;
  }
  bool open(Json fresh) {
    if (levels_.size() >= kMaxJsonDepth) {
      error = "nested deeper than " + std::to_string(kMaxJsonDepth) + " levels";
      error_offset = previous_end_;
      return false;
    }
    const auto [value, begins] = place(std::move(fresh));
    begins->inner = std::make_unique<JsonPlace::Inner>();
    levels_.push_back({value, begins->inner.get(), ""});
    return true;
  }
  bool close() {
    levels_.pop_back();
    previous_end_ = std::min(read_, text_.size());
    return true;
  }

  const std::string& text_;
  const std::size_t& read_;
  JsonPlace& places_;
  std::vector<Level> levels_;
  std::size_t previous_end_ = 0;
};

}  // namespace

struct JsonSource::Places {
  explicit Places(const std::string& text) : lines(text) {}
  LineTable lines;
  JsonPlace root;
};

Json parsed_json(std::string_view text, std::size_t deepest) {
  deepest = std::min(deepest, kMaxJsonDepth);
  std::size_t depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char letter = text[i];
    if (letter == '"') in_text = !in_text;
    if (in_text && letter == '\\') ++i;
    if (in_text) continue;
    if ((letter == '[' || letter == '{') && ++depth > deepest) return Json(Json::value_t::discarded);
    if ((letter == ']' || letter == '}') && depth > 0) --depth;
  }
  return Json::parse(text, nullptr, false);
}

JsonSource JsonSource::from_file(const std::filesystem::path& path) {
  std::error_code code;
  if (const std::uintmax_t size = std::filesystem::file_size(path, code); !code && size > kLargestFile)
    throw Error(ErrorKind::bad_input, path.string() + ": the file has " + std::to_string(size >> 20U) +
                                          " MB; JSON files may have at most " + std::to_string(kLargestFile >> 20U) +
                                          " MB");
  return from_text(read_file(path, kLargestFile), path.string());
}

JsonSource JsonSource::from_text(std::string text, std::string file_name) {
  JsonSource source;
  source.file_ = std::move(file_name);
  source.text_ = std::move(text);
  std::size_t read = 0;
  const auto places = std::make_shared<Places>(source.text_);
  Builder builder(source.text_, read, places->root);
  const char* begin = source.text_.data();
  const bool parsed =
      Json::sax_parse(CountingIterator{begin, &read}, CountingIterator{begin + source.text_.size(), nullptr}, &builder);
  if (!parsed) {
    Problem problem;
    problem.file = source.file_;
    std::tie(problem.line, problem.column) = places->lines.line_and_column(source.text_, builder.error_offset);
    problem.message = "invalid JSON: " + builder.error;
    throw_if_any({problem});
  }
  source.root_ = std::move(builder.root);
  source.places_ = places;
  return source;
}

JsonSource JsonSource::from_value(Json value, std::string file_name) {
  JsonSource source;
  source.file_ = std::move(file_name);
  source.root_ = std::move(value);
  return source;
}

Problem JsonSource::problem(const std::string& pointer, const std::string& message) const {
  Problem problem;
  problem.file = file_;
  problem.pointer = pointer;
  problem.message = message;
  if (places_)
    std::tie(problem.line, problem.column) =
        places_->lines.line_and_column(text_, place_of(places_->root, pointer).offset);
  return problem;
}

std::string canonical_json(const Json& value) { return value.dump(); }

}  // namespace relign
