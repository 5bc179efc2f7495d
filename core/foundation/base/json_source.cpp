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

// Builds the document alone, which is faster.
class TreeBuilder : public nlohmann::json_sax<Json> {
 public:
  explicit TreeBuilder(std::size_t deepest) : deepest_(deepest) {}

  Json root;

  bool null() override { return add(nullptr) != nullptr; }
  bool boolean(bool v) override { return add(v) != nullptr; }
  bool number_integer(number_integer_t v) override { return add(v) != nullptr; }
  bool number_unsigned(number_unsigned_t v) override { return add(v) != nullptr; }
  bool number_float(number_float_t v, const string_t&) override { return add(v) != nullptr; }
  bool string(string_t& v) override { return add(std::move(v)) != nullptr; }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    const auto [member, fresh] = levels_.back()->get_ref<Json::object_t&>().emplace(std::move(name), nullptr);
    member_ = &member->second;
    return fresh;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  template <class Value>
  Json* add(Value&& value) {
    if (levels_.empty()) return &(root = std::forward<Value>(value));
    if (levels_.back()->is_object()) return &(*member_ = std::forward<Value>(value));
    auto& list = levels_.back()->get_ref<Json::array_t&>();
    list.emplace_back(std::forward<Value>(value));
    return &list.back();
  }
  bool open(Json fresh) {
    if (levels_.size() >= deepest_) return false;
    levels_.push_back(add(std::move(fresh)));
    return true;
  }
  bool close() {
    levels_.pop_back();
    return true;
  }

  std::size_t deepest_;
  std::vector<Json*> levels_;  // the open lists and objects
  Json* member_ = nullptr;     // of the innermost object, whose key was read last
};

struct Fault {
  std::size_t offset = 0;
  std::string message;  // empty if there is none
};

std::pair<Json, Fault> parsed_with_places(const std::string& text, JsonPlace& places) {
  std::size_t read = 0;
  Builder builder(text, read, places);
  const char* begin = text.data();
  if (Json::sax_parse(CountingIterator{begin, &read}, CountingIterator{begin + text.size(), nullptr}, &builder))
    return {std::move(builder.root), Fault()};
  return {nullptr, {builder.error_offset, builder.error}};
}

}  // namespace

struct JsonSource::Places {
  explicit Places(const std::string& text) : lines(text) {}
  LineTable lines;
  JsonPlace root;
};

Json parsed_json(std::string_view text, std::size_t deepest) {
  TreeBuilder builder(std::min(deepest, kMaxJsonDepth));
  if (!Json::sax_parse(text.begin(), text.end(), &builder)) return Json(Json::value_t::discarded);
  return std::move(builder.root);
}

Json valid_json(std::string_view text) {
  Json value = parsed_json(text);
  if (!value.is_discarded()) return value;
  const std::string copy(text);
  JsonPlace ignored;
  const Fault fault = parsed_with_places(copy, ignored).second;
  const auto [line, column] = LineTable(copy).line_and_column(copy, fault.offset);
  throw Error(ErrorKind::bad_input, "invalid JSON at line " + std::to_string(line) + ", column " +
                                        std::to_string(column) + ": " + fault.message);
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
  const auto places = std::make_shared<Places>(source.text_);
  auto [root, fault] = parsed_with_places(source.text_, places->root);
  if (!fault.message.empty()) {
    Problem problem;
    problem.file = source.file_;
    std::tie(problem.line, problem.column) = places->lines.line_and_column(source.text_, fault.offset);
    problem.message = "invalid JSON: " + fault.message;
    throw_if_any({problem});
  }
  source.root_ = std::move(root);
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
