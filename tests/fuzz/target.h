// What every target of this folder demands of a reader: it takes the input, or says in a relign::Error what is wrong
// with it. Everything else ends the program, and the input that did it is kept.
//
// A target is one function, LLVMFuzzerTestOneInput, linked to libFuzzer where the tree is built with it (preset fuzz)
// and to drive.cpp elsewhere. See CONTRIBUTING.md for how to run one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace relign::fuzz {

inline std::string text_of(const std::uint8_t* data, std::size_t size) {
  return std::string(reinterpret_cast<const char*>(data), size);
}

// Ends the program with `what` when it does not hold.
void demand(bool holds, const std::string& what);

// True when `read` took the input, false when it threw an Error that can be shown to a person.
bool accepted(const std::function<void()>& read);

// A folder in memory of this process, removed at its end.
const std::filesystem::path& scratch_folder();
// Plain and quick, where write_file_atomically would wait for a disk.
void write_scratch(const std::filesystem::path& file, std::string_view content);

}  // namespace relign::fuzz
