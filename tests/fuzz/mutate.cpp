#include "mutate.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

namespace relign::fuzz {
namespace {

constexpr std::size_t kMaxWords = 2000;
constexpr std::size_t kLongestWord = 40;

const std::vector<std::string>& numbers() {
  static const std::vector<std::string> kNumbers = {"0",
                                                    "-0",
                                                    "1",
                                                    "-1",
                                                    "0.5",
                                                    "1e9",
                                                    "1e300",
                                                    "1e-320",
                                                    "1e999",
                                                    "-1e308",
                                                    "2147483647",
                                                    "-2147483648",
                                                    "4294967296",
                                                    "1000000000",
                                                    "9223372036854775807",
                                                    "65536",
                                                    "255",
                                                    "nan",
                                                    "inf",
                                                    "18446744073709551615",
                                                    "99999999999999999999999",
                                                    "0x7fffffff",
                                                    "0.1e+1.5",
                                                    "-9223372036854775808"};
  return kNumbers;
}

// What names may hold, and what breaks lines, texts and paths.
const std::vector<std::string>& strange_texts() {
  static const std::vector<std::string> kTexts = {"\n",
                                                  "\r\n",
                                                  std::string(1, '\0'),
                                                  "\x1b[2J",
                                                  "\xff",
                                                  "\xc0\x80",
                                                  "\xed\xa0\x80",
                                                  "\xe2\x80\xae",
                                                  "\xef\xbb\xbf",
                                                  "\\u0000",
                                                  "\\ud800",
                                                  "\\u001b",
                                                  "../",
                                                  "/",
                                                  "\"",
                                                  "'",
                                                  "\\",
                                                  "<script>",
                                                  "$(touch x)",
                                                  ";",
                                                  "{",
                                                  "}",
                                                  "[",
                                                  "]",
                                                  "null",
                                                  "true",
                                                  ",",
                                                  ":",
                                                  "{\"use\":",
                                                  "\"\"",
                                                  "\t",
                                                  "%s%n",
                                                  "~0~1"};
  return kTexts;
}

bool is_of_number(char letter) {
  return (letter >= '0' && letter <= '9') || letter == '.' || letter == '-' || letter == '+' || letter == 'e';
}

}  // namespace

Mutator::Mutator(std::uint64_t seed, const std::vector<std::string>& corpus, std::vector<std::string> words,
                 std::size_t most_bytes)
    : random_(seed), corpus_(corpus), words_(std::move(words)), most_bytes_(most_bytes) {
  words_.insert(words_.end(), strange_texts().begin(), strange_texts().end());
}

std::string Mutator::next() {
  std::string bytes = corpus_[below(corpus_.size())];
  const std::size_t most = std::max(most_bytes_, bytes.size());
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) change(bytes);
  if (bytes.size() > most) bytes.resize(most);
  return bytes;
}

void Mutator::change(std::string& bytes) {
  const std::size_t at = below(bytes.size() + 1);
  switch (random_() % 11) {
    case 0:
      if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
      break;
    case 1:
      if (at < bytes.size()) bytes[at] = static_cast<char>(random_());
      break;
    case 2:
      bytes.resize(at);
      break;
    case 3:
      bytes.erase(at, 1 + below(40));
      break;
    case 4:
      bytes.insert(at, words_[below(words_.size())]);
      break;
    case 5:
    case 6:
      change_number(bytes);
      break;
    case 7: {  // a piece twice
      const std::string piece = bytes.substr(at, 1 + below(80));
      bytes.insert(at, piece);
      break;
    }
    case 8: {  // another input's end
      const std::string& other = corpus_[below(corpus_.size())];
      bytes = bytes.substr(0, at) + other.substr(below(other.size() + 1));
      break;
    }
    case 9: {  // the same many times: depth, or length
      const std::string& word = words_[below(words_.size())];
      std::string many;
      for (std::size_t times = 1 + below(300); times > 0 && many.size() < most_bytes_; --times) many += word;
      bytes.insert(at, many);
      break;
    }
    default: {  // one word for another
      const std::size_t found = bytes.find(words_[below(words_.size())], at);
      if (found == std::string::npos) break;
      std::size_t end = found;
      while (end < bytes.size() && std::isalnum(static_cast<unsigned char>(bytes[end]))) ++end;
      bytes.replace(found, std::max<std::size_t>(end - found, 1), words_[below(words_.size())]);
    }
  }
}

void Mutator::change_number(std::string& bytes) {
  const std::size_t from = below(bytes.size() + 1);
  std::size_t begin = from;
  while (begin < bytes.size() && !std::isdigit(static_cast<unsigned char>(bytes[begin]))) ++begin;
  std::size_t end = begin;
  while (end < bytes.size() && is_of_number(bytes[end])) ++end;
  bytes.replace(begin, end - begin, numbers()[below(numbers().size())]);
}

std::vector<std::string> words_of(const std::vector<std::string>& corpus) {
  std::set<std::pair<std::size_t, std::string>> found;
  const auto add = [&found](const std::string& word) {
    if (!word.empty() && word.size() <= kLongestWord) found.emplace(word.size(), word);
  };
  for (const std::string& bytes : corpus) {
    std::string word;
    for (const char letter : bytes) {
      if (std::isalnum(static_cast<unsigned char>(letter)) || letter == '_' || letter == '-' || letter == '.') {
        word += letter;
      } else {
        add(word);
        word.clear();
      }
    }
    add(word);
  }
  std::vector<std::string> words;
  for (const auto& [size, word] : found)
    if (words.size() < kMaxWords) words.push_back(word);
  return words;
}

}  // namespace relign::fuzz
