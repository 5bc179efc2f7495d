// A temporary folder for each test, and helpers to create plugins in it.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "error_text.h"

namespace relign::test {

class FolderTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::canonical(std::filesystem::temp_directory_path()) /
              ("relign-host-" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::filesystem::path& name, const std::string& content) {
    const std::filesystem::path path = folder_ / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }

  // A plugin folder with a manifest and a file in place of the library (never loaded here).
  std::filesystem::path plugin(const std::string& folder, const std::string& manifest, const std::string& library) {
    write(folder + "/relign-plugin.json", manifest);
    write(folder + "/" + library, "not loaded");
    return folder_ / folder;
  }

  std::filesystem::path folder_;
};

}  // namespace relign::test
