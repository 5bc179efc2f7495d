// Errors for any file in place of a library: they name what it was built for, what is supported and what to do, and the
// process survives.
#include "plugin_host/library.h"

#include <elf.h>
#include <gmock/gmock.h>

#include <cstring>
#include <thread>

#include "base/files.h"
#include "plugin_host/objects.h"
#include "test_folder.h"

namespace relign::plugin_host {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

const char* const kForeignManifest = R"({"id": "foreign", "kind": "optimizer", "summary": "For tests."})";

class LibraryTest : public test::FolderTest {
 protected:
  // A plugin folder with these bytes as its library.
  Choice choice_of(const std::string& library_bytes, const std::string& manifest = kForeignManifest) {
    const std::string name = "plugin" + std::to_string(++made_);
    plugin(name, manifest, "foreign.so");
    write(name + "/foreign.so", library_bytes);
    Catalog catalog;
    catalog.add(folder_ / name);
    return catalog.resolve_or_throw(catalog.plugins().at(0)->kind, "foreign");
  }
  static std::string bytes_of(const std::string& variant) {
    return read_file(fs::path(RELIGN_TEST_PLUGINS) / "foreign" / (variant + ".so"));
  }
  std::string refusal(const std::string& library_bytes, const std::string& manifest = kForeignManifest) {
    const Choice choice = choice_of(library_bytes, manifest);
    const std::string text = test::error_text(ErrorKind::plugin_rejected, [&] {
      if (choice.plugin->kind == Kind::optimizer)
        Algorithm made(choice, {});
      else
        Scene made(choice, {});
    });
    EXPECT_THAT(text, AllOf(HasSubstr("'foreign' refused: "), HasSubstr("built for:"), HasSubstr("supported:"),
                            HasSubstr("what to do:"), HasSubstr("foreign.so")));
    return text;
  }
  // Never reused, because a library is loaded once per process and path.
  static inline int made_ = 0;
};

TEST_F(LibraryTest, RunsPluginsOfOtherCompilersAndNewerMinorVersions) {
  // A plugin of a later minor version runs as well, if it does not need what that version added.
  for (const char* variant : {"sound", "newer_minor"}) {
    SCOPED_TRACE(variant);
    const Choice choice = choice_of(bytes_of(variant));
    Algorithm algorithm(choice, {});
    relign_trial trial{};
    trial.struct_size = sizeof trial;
    algorithm.run(trial);
    EXPECT_EQ(&load_library(*choice.plugin), &load_library(*choice.plugin));
  }
}

TEST_F(LibraryTest, RejectsOtherVersionsAndNamesBoth) {
  const auto version = [](int major, int minor) { return std::to_string(major) + "." + std::to_string(minor); };
  EXPECT_THAT(
      refusal(bytes_of("newer_major")),
      AllOf(HasSubstr("plugin interface " + version(RELIGN_ABI_MAJOR + 1, RELIGN_ABI_MINOR) + ", foreign compiler 1.0"),
            HasSubstr("supported:  plugin interface " + version(RELIGN_ABI_MAJOR, RELIGN_ABI_MINOR)),
            HasSubstr("update relign-bench")));
  EXPECT_THAT(refusal(bytes_of("older_major")), HasSubstr("rebuild the plugin"));
}

TEST_F(LibraryTest, RejectsIncompleteTables) {
  EXPECT_THAT(refusal(bytes_of("short_description")), HasSubstr("its description has only 8 bytes"));
  EXPECT_THAT(refusal(bytes_of("short_table")), HasSubstr("has 16 bytes; expected at least 32"));
  EXPECT_THAT(refusal(bytes_of("no_run")), HasSubstr("no function 'run'"));
  EXPECT_THAT(refusal(bytes_of("no_interface")), HasSubstr("offers no relign.algorithm/1"));
  EXPECT_THAT(refusal(bytes_of("no_entry")), HasSubstr("does not export relign_plugin_entry"));
}

TEST_F(LibraryTest, NamesMissingSymbols) {
  EXPECT_THAT(refusal(bytes_of("undefined_symbol")),
              AllOf(HasSubstr("relign_nobody_defines_this"), HasSubstr("LIBRARIES")));
}

TEST_F(LibraryTest, RejectsManifestThatDiffersFromTheOneInside) {
  EXPECT_THAT(refusal(bytes_of("sound"), R"({"id": "foreign", "kind": "optimizer", "summary": "Changed."})"),
              AllOf(HasSubstr("differs from the one inside the library"), HasSubstr("build the plugin again")));
  EXPECT_THAT(refusal(bytes_of("sound"), R"({"id": "foreign", "kind": "scene", "summary": "For tests."})"),
              HasSubstr("differs from the one inside the library"));
}

TEST_F(LibraryTest, RejectsLibrariesTruncatedAtAnyLength) {
  const std::string whole = bytes_of("sound");
  for (int part = 0; part < 16; ++part)
    EXPECT_THAT(refusal(whole.substr(0, whole.size() * static_cast<std::size_t>(part) / 16)),
                testing::AnyOf(HasSubstr("truncated"), HasSubstr("is not a shared library")));
  EXPECT_THAT(refusal(whole.substr(0, whole.size() - 1)), HasSubstr("truncated"));
  // Without the section table only the program headers remain.
  Elf64_Ehdr header;
  std::memcpy(&header, whole.data(), sizeof header);
  header.e_shoff = 0;
  header.e_shnum = 0;
  std::string no_sections = whole.substr(0, whole.size() / 3);
  std::memcpy(no_sections.data(), &header, sizeof header);
  EXPECT_THAT(refusal(no_sections), HasSubstr("truncated"));
}

TEST_F(LibraryTest, RejectsOtherFiles) {
  EXPECT_THAT(refusal("#!/bin/sh\nexit 0\n"), HasSubstr("is not a shared library"));
  EXPECT_THAT(refusal(std::string(5000, '\0')), HasSubstr("is not a shared library"));
  std::string other_processor = bytes_of("sound");
  other_processor[offsetof(Elf64_Ehdr, e_machine)] = static_cast<char>(EM_RISCV);
  EXPECT_THAT(refusal(other_processor), HasSubstr("another kind of processor"));
  std::string nonsense = bytes_of("sound");
  std::fill(nonsense.begin() + sizeof(Elf64_Ehdr), nonsense.begin() + sizeof(Elf64_Ehdr) + 512, '\xff');
  EXPECT_THAT(refusal(nonsense), HasSubstr("truncated or corrupt"));
}

TEST_F(LibraryTest, RejectsMissingLibraries) {
  const Choice choice = choice_of(bytes_of("sound"));
  fs::remove(choice.plugin->library);
  EXPECT_THAT(test::error_text(ErrorKind::plugin_rejected, [&] { Algorithm made(choice, {}); }),
              HasSubstr("cannot find its library"));
}

TEST_F(LibraryTest, LoadsTheSameLibraryFromSeveralThreads) {
  const Choice choice = choice_of(bytes_of("sound"));
  std::vector<const relign_plugin_description*> seen(8);
  std::vector<std::thread> threads;
  for (auto& place : seen) threads.emplace_back([&choice, &place] { place = &load_library(*choice.plugin); });
  for (std::thread& thread : threads) thread.join();
  for (const auto* entry : seen) EXPECT_EQ(entry, seen[0]);
}

TEST_F(LibraryTest, ReportsFailuresOfObjectsAsPluginFailed) {
  relign_trial trial{};
  trial.struct_size = sizeof trial;
  const auto failure = [&](const char* variant) {
    const Choice choice = choice_of(bytes_of(variant));
    return test::error_text(ErrorKind::plugin_failed, [&] { Algorithm(choice, {}).run(trial); });
  };
  EXPECT_EQ(failure("throws").find("plugin 'foreign' failed in run: an exception escaped from the library"), 0u);
  EXPECT_THAT(failure("no_object"), HasSubstr("failed in create: it returned no object"));
  EXPECT_THAT(failure("no_reason"), HasSubstr("failed in run: it reported a failure without a reason"));
  EXPECT_THAT(failure("unknown_status"), HasSubstr("unknown status -77"));
}

}  // namespace
}  // namespace relign::plugin_host
