// Exceptions of libraries never reach a user in their own words.
#include "base/fault.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <new>
#include <stdexcept>

#include "base/error.h"

namespace relign {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string text_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const std::exception& error) {
    return fault_text(error);
  }
  return "no exception";
}

TEST(Fault, NamesWhatIsWrongWithJson) {
  const json object = {{"a", 1}};
  EXPECT_EQ(text_of([&] { static_cast<void>(object.at("step")); }), "missing key 'step'");
  EXPECT_EQ(text_of([&] { static_cast<void>(object.at("a").get<std::string>()); }), "expected string, found number");
  EXPECT_THAT(
      text_of([] { [[maybe_unused]] const json parsed = json::parse("{\"a\": 1 \"b\": 2}"); }),
      AllOf(HasSubstr("invalid JSON at line 1, column 11: unexpected string literal"), Not(HasSubstr("exception"))));
  EXPECT_THAT(text_of([] { [[maybe_unused]] const json parsed = json::parse(""); }),
              HasSubstr("invalid JSON at line 1, column 1: unexpected end of input"));
  EXPECT_EQ(text_of([] { [[maybe_unused]] const json parsed = json::parse("[1e999]"); }),
            "invalid JSON: the number 1e999 is out of range");
}

TEST(Fault, NamesFilesAndTheSystemsReason) {
  EXPECT_EQ(text_of([] { static_cast<void>(std::filesystem::file_size("no/such")); }),
            "cannot access 'no/such': No such file or directory");
  EXPECT_EQ(text_of([] { std::filesystem::rename("no/such", "other"); }),
            "cannot access 'no/such' or 'other': No such file or directory");
}

TEST(Fault, KeepsErrorsAndQuotesTheUnexpected) {
  EXPECT_EQ(text_of([] { throw Error(ErrorKind::io, "the disk is full"); }), "the disk is full");
  EXPECT_EQ(text_of([] { throw std::bad_alloc(); }), "out of memory");
  EXPECT_EQ(text_of([] { throw std::out_of_range("stoul"); }),
            "unexpected exception 'stoul'; please report it with the command");
}

}  // namespace
}  // namespace relign
