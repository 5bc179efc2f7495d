// The lists of scenes, noise levels and algorithms of a suite: entries by id, path or with parameters, checked against
// the catalogue and against each other.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/json_source.h"
#include "plugin_host/catalog.h"

namespace relign::suites {

// Reads one of a few allowed strings; returns the fallback after a mistake.
std::string one_of(ObjectReader& reader, const std::string& key, const std::vector<std::string>& allowed,
                   const std::string& fallback);

// Reads "protocol" or the list "protocols"; returns the fallback where both are missing, and after a mistake.
std::vector<std::string> read_protocols(ObjectReader& reader, const std::vector<std::string>& fallback);

// Empty for a valid name. Names are restricted because they appear in tables, file names and on command lines (--only
// algorithm=NAME).
std::string name_mistake(const std::string& name);

// What the suite says for all algorithms.
struct EntryDefaults {
  std::vector<std::string> protocols = {"paper"};
  unsigned steps = 50;
};

// One entry of scenes, noise_levels or algorithms.
struct Entry {
  std::string pointer;
  bool usable = false;
  std::string name;
  bool named = false;
  plugin_host::Choice choice;
  std::vector<std::string> protocols;
  std::string merit;
  unsigned steps = 0;
  std::string method, training;  // for an entry with a list of trainings
};

class EntryReader {
 public:
  // source, catalog and problems must outlive the reader. Mistakes are added to `problems`.
  EntryReader(const JsonSource& source, const std::filesystem::path& relative_to, plugin_host::Catalog& catalog,
              EntryDefaults defaults, std::vector<Problem>& problems);

  // The usable entries of the list at a key of the suite; one for each training of an entry with several.
  std::vector<Entry> read(ObjectReader& suite, const std::string& key, plugin_host::Kind kind);

 private:
  std::vector<Entry> read_entry(const std::string& pointer, const Json& value, plugin_host::Kind kind);
  std::vector<Entry> with_trainings(ObjectReader& reader, const Entry& entry, plugin_host::Kind kind,
                                    const std::string& use, const Json& parameters, const Json& trainings);
  void resolve(Entry& entry, plugin_host::Kind kind, const std::string& use, const Json& parameters,
               const std::string& use_pointer, const std::string& also_there = "");
  void refuse_name_of_baseline(const Entry& entry, const std::string& pointer);
  void refuse_nested(const Entry& entry, const plugin_host::Choice& outer, const std::string& pointer);
  void refuse_clashes(const std::vector<Entry>& entries, bool algorithms);
  void complain(const std::string& pointer, const std::string& message);

  const JsonSource& source_;
  std::filesystem::path relative_to_;
  plugin_host::Catalog& catalog_;
  EntryDefaults defaults_;
  std::vector<Problem>& problems_;
};

}  // namespace relign::suites
