// Exceptions of libraries in the words of this program: their own texts name functions and classes that users do not
// know.
#pragma once

#include <exception>
#include <nlohmann/json.hpp>
#include <string>

namespace relign {

// "missing key 'step'", "expected number, found string", "invalid JSON at column 7: ...".
std::string json_fault(const nlohmann::json::exception& error);

// What is wrong with JSON, from the text of its parser's exception: "unexpected string literal; expected '}'".
std::string syntax_fault(const std::string& text);

// Of any exception: an Error's own text, "out of memory", "cannot access 'x': Permission denied". Of an exception that
// no code expects, which is a mistake of this program, its text in quotes with the request to report it.
std::string fault_text(const std::exception& error);

}  // namespace relign
