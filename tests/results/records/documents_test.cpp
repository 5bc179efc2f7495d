// Schemas and tables of documents that follow from manifests, the columns of records and the criteria. After a change
// of them:
//   RELIGN_UPDATE_GOLDEN=1 ctest --test-dir build/release -R records_documents
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "base/criteria.h"
#include "base/files.h"
#include "described_schema.h"
#include "records/manifest.h"
#include "records/picture_index.h"
#include "records/record.h"
#include "records/trial_ends.h"

namespace relign {

template <>
inline constexpr std::string_view kDefinition<MachineTimeKeys> = "machine_time";
template <>
inline constexpr std::string_view kDefinition<records::Program> = "program";
template <>
inline constexpr std::string_view kDefinition<records::Machine> = "machine";
template <>
inline constexpr std::string_view kDefinition<records::Shard> = "shard";
template <>
inline constexpr std::string_view kDefinition<records::SandboxLimits> = "sandbox";

}  // namespace relign

namespace relign::records {
namespace {

namespace fs = std::filesystem;
using Ordered = nlohmann::ordered_json;

const fs::path kRoot = RELIGN_SOURCE_DIR;

std::vector<std::string> split_lines(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// The lines from the first difference to the last one.
std::string differing_lines(const std::string& was, const std::string& is) {
  std::vector<std::string> old = split_lines(was), now = split_lines(is);
  while (!old.empty() && !now.empty() && old.back() == now.back()) old.pop_back(), now.pop_back();
  const auto [from, to] = std::mismatch(old.begin(), old.end(), now.begin(), now.end());
  std::string text;
  std::for_each(from, old.end(), [&text](const std::string& line) { text += "\n- " + line; });
  std::for_each(to, now.end(), [&text](const std::string& line) { text += "\n+ " + line; });
  return text;
}

// Compares a file of the tree with what it should be, or writes it.
void approve(const fs::path& file, const std::string& expected) {
  if (std::getenv("RELIGN_UPDATE_GOLDEN")) write_file_atomically(file, expected);
  if (const std::string found = read_file(file); found != expected)
    ADD_FAILURE() << file << " is stale; update it as this test says at its top" << differing_lines(found, expected);
}

TEST(Documents, AFailureShowsTheDifferingLines) {
  EXPECT_EQ(differing_lines("a\nb\nc\n", "a\nB\nB\nc\n"), "\n- b\n+ B\n+ B");
  EXPECT_EQ(differing_lines("a\nc\n", "a\nb\nc\n"), "\n+ b");
}

// With a space per level; what fits into a line is in one.
std::string pretty(const Ordered& value, std::size_t indent = 0) {
  constexpr std::size_t kLongest = 130;
  std::string line = value.dump(-1, ' ', false);
  std::string spaced;
  bool text = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && (i == 0 || line[i - 1] != '\\')) text = !text;
    spaced += line[i];
    if (!text && (line[i] == ',' || line[i] == ':')) spaced += ' ';
  }
  if (indent > 0 && spaced.size() + indent <= kLongest) return spaced;
  if (!value.is_structured() || value.empty()) return spaced;
  std::string lines;
  for (const auto& [key, member] : value.items())
    lines += (lines.empty() ? "\n" : ",\n") + std::string(indent + 1, ' ') +
             (value.is_object() ? "\"" + key + "\": " : "") + pretty(member, indent + 1);
  return (value.is_object() ? "{" : "[") + lines + "\n" + std::string(indent, ' ') + (value.is_object() ? "}" : "]");
}

Ordered number_type(const Column& column) {
  Ordered schema = {{"type", column.is(kKnown) ? Ordered("number") : Ordered({"number", "null"})}};
  if (column.is(kShare)) schema.update({{"minimum", 0}, {"maximum", 1}});
  return schema;
}

Ordered schema_of(const Column& column, double) { return number_type(column); }
Ordered schema_of(const Column& column, const std::vector<double>&) {
  return {{"type", "array"}, {"items", number_type(column)}};
}
Ordered schema_of(const Column&, unsigned) { return {{"type", "integer"}, {"minimum", 0}}; }
Ordered schema_of(const Column& column, std::uint64_t) {
  if (column.is(kAsText)) return {{"type", "string"}, {"pattern", "^[0-9]{1,20}$"}};
  return {{"type", "integer"}, {"minimum", 0}};
}
Ordered schema_of(const Column& column, const std::string&) {
  if (column.one_of.empty()) return {{"type", "string"}};
  Ordered words = Ordered::array();
  for (std::string_view rest = column.one_of; !rest.empty();) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    words.push_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return {{"enum", words}};
}
Ordered schema_of(const Column&, const std::vector<std::string>&) {
  return {{"type", "array"}, {"items", {{"type", "string"}}}};
}
Ordered schema_of(const Column&, const PixelRegions&) {
  const Ordered whole = {{"type", "integer"}, {"minimum", 0}};
  return {{"type", "array"},
          {"minItems", 1},
          {"maxItems", kMaxRegions},
          {"items", {{"type", "array"}, {"minItems", 4}, {"maxItems", 4}, {"items", whole}}}};
}

std::string meaning_of(const Column& column) {
  return std::string(column.meaning) + (column.is(kPerStep) ? "; one value per step" : "");
}

struct SchemaWriter {
  Ordered& line;
  template <class Value>
  void operator()(const Column& column, const Value& value) {
    Ordered schema = schema_of(column, value);
    schema["description"] = meaning_of(column);
    line["properties"][std::string(column.key)] = schema;
    if (!column.is(kOptional)) line["required"].push_back(column.key);
  }
};

// A line's schema with its first members as they are now: no columns describe them.
Ordered line_schema(const Ordered& now, std::initializer_list<const char*> first) {
  Ordered line = {{"type", "object"}, {"required", first}, {"properties", Ordered::object()}};
  for (const char* key : first) line["properties"][key] = now["properties"][key];
  return line;
}

TEST(Documents, TheSchemaOfTrialsHasTheColumns) {
  const fs::path file = kRoot / "docs/schemas/trials.schema.json";
  Ordered schema = Ordered::parse(read_file(file));
  StepRecord step;
  TrialRecord trial;
  Ordered& lines = schema["definitions"];
  Ordered steps = line_schema(lines["step"], {"trial"});
  step_columns(SchemaWriter{steps}, step);
  Ordered closing = line_schema(lines["closing"], {"format", "trial", "end", "steps"});
  trial_columns(SchemaWriter{closing}, trial);
  closing["required"].push_back("sha256");
  closing["properties"]["sha256"] = lines["closing"]["properties"]["sha256"];
  for (Ordered* line : {&steps, &closing}) (*line)["additionalProperties"] = false;
  lines["step"] = steps;
  lines["closing"] = closing;
  approve(file, pretty(schema) + "\n");
}

TEST(Documents, TheSchemaOfTheTrialThatTryPrintsHasTheColumns) {
  const fs::path file = kRoot / "docs/schemas/printed.schema.json";
  Ordered schema = Ordered::parse(read_file(file));
  Ordered step = {{"type", "object"}, {"required", Ordered::array()}, {"properties", Ordered::object()}};
  const StepRecord none;
  step_columns(SchemaWriter{step}, none);
  step["additionalProperties"] = false;
  schema["definitions"]["try"]["properties"]["steps"]["items"] = step;
  approve(file, pretty(schema) + "\n");
}

TEST(Documents, TheSchemaOfManifestsHasTheirMembers) {
  Ordered schema = {{"$schema", "http://json-schema.org/draft-07/schema#"},
                    {"title", "relign-bench results manifest"},
                    {"description", "manifest.json of a results folder. results/README.md"}};
  schema.update(DescribedSchema().of_document<Manifest>());
  approve(kRoot / "docs/schemas/manifest.schema.json", pretty(schema) + "\n");
}

TEST(Documents, TheSchemaOfPicturesHasTheirMembers) {
  Ordered schema = {{"$schema", "http://json-schema.org/draft-07/schema#"},
                    {"title", "relign-bench pictures"},
                    {"description", "pictures/index.json of a results folder. results/README.md"}};
  schema.update(DescribedSchema().of_document<PictureIndex>());
  approve(kRoot / "docs/schemas/pictures.schema.json", pretty(schema) + "\n");
}

// The Python package reads records without the schemas.
TEST(Documents, PythonHasTheColumnsOfDataFrames) {
  std::string tabled, per_step;
  const auto add = [&](const Column& column, const auto&) {
    if (column.is(kTabled)) tabled += "    \"" + std::string(column.key) + "\",\n";
    if (column.is(kPerStep)) per_step += "    \"" + std::string(column.key) + "\",\n";
  };
  const TrialRecord none;
  trial_columns(add, none);
  approve(kRoot / "python/relign_bench/_columns.py",
          "\"\"\"Columns of closing lines that data frames contain.\n\nWritten by "
          "tests/results/records/documents_test.cpp from trial_columns.\n\"\"\"\n\n"
          "#: One value per trial.\nTABLED = (\n" +
              tabled + ")\n\n#: One value per step.\nPER_STEP = (\n" + per_step + ")\n");
}

TEST(Documents, TheSchemaOfSpecificationsHasTheCriteria) {
  const fs::path file = kRoot / "docs/schemas/spec.schema.json";
  Ordered schema = Ordered::parse(read_file(file)), limits = Ordered::object(), judged = {"rmse"};
  for (const char* key : {"rmse", "score", "further_scores", "mtf", "field_mtf"})
    limits[key] = schema["properties"][key];
  for (const CriterionEntry& entry : kCriterionEntries) {
    judged.push_back(entry.column);
    if (!entry.key.empty() && !limits.contains(entry.key))
      limits[std::string(entry.key)] = {
          {"type", "number"}, {"minimum", 0}, {"description", std::string(entry.meaning) + ", at most"}};
  }
  judged.push_back("all");
  schema["properties"] = limits;
  schema["definitions"]["judged"]["enum"] = judged;
  approve(file, pretty(schema) + "\n");
}

// Replaces the lines between "<!-- NAME -->" and "<!-- end -->" of a document.
void approve_table(const fs::path& file, const std::string& name, const std::string& table) {
  const std::string begin = "<!-- " + name + " -->\n", end = "<!-- end -->";
  std::string text = read_file(file);
  const std::size_t from = text.find(begin), to = text.find(end, from);
  ASSERT_NE(to, std::string::npos) << file << " has no place for the table '" << name << "'";
  approve(file, text.replace(from + begin.size(), to - from - begin.size(), "\n" + table + "\n"));
}

struct TableWriter {
  std::string& table;
  template <class Value>
  void operator()(const Column& column, const Value&) {
    // Units of criteria begin with a space, for texts.
    const std::string_view unit = column.unit.substr(column.unit.starts_with(' ') ? 1 : 0);
    table += "| `" + std::string(column.key) + "` | " + std::string(unit) + " | " + meaning_of(column) +
             (column.is(kOptional) ? " (optional)" : "") + " |\n";
  }
};

TEST(Documents, TablesOfTheFormatHaveTheColumns) {
  StepRecord step;
  TrialRecord trial;
  std::string steps = "| member of a step | unit | |\n|---|---|---|\n";
  std::string closing = "| member of a closing line | unit | |\n|---|---|---|\n";
  step_columns(TableWriter{steps}, step);
  trial_columns(TableWriter{closing}, trial);
  approve_table(kRoot / "results/README.md", "columns of a step", steps);
  approve_table(kRoot / "results/README.md", "columns of a closing line", closing);
}

TEST(Documents, TheTableAndTheSchemaOfTrialsHaveTheEnds) {
  std::string table = "| `end` | |\n|---|---|\n", pattern;
  for (const Explanation& end : kTrialEnds) {
    table += "| `" + std::string(end.code) + "` | " + std::string(end.meaning) + " |\n";
    pattern += (pattern.empty() ? "^(" : "|") + std::string(end.code) + (end.code == "crashed" ? "\\(.+\\)" : "");
  }
  approve_table(kRoot / "results/README.md", "ends", table);
  const fs::path file = kRoot / "docs/schemas/trials.schema.json";
  Ordered schema = Ordered::parse(read_file(file));
  schema["definitions"]["closing"]["properties"]["end"]["pattern"] = pattern + ")$";
  approve(file, pretty(schema) + "\n");
}

TEST(Documents, TheTableOfCriteriaHasThemAll) {
  std::string table = "| limit | of |\n|---|---|\n";
  for (const CriterionEntry& entry : kCriterionEntries)
    if (!entry.key.empty()) table += "| `" + std::string(entry.key) + "` | " + std::string(entry.meaning) + " |\n";
  approve_table(kRoot / "docs/suites.md", "criteria", table);
}

}  // namespace
}  // namespace relign::records
