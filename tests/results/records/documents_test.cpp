// Schemas and tables of documents that follow from manifests, the columns of records and the criteria. After a change
// of them:
//   RELIGN_UPDATE_GOLDEN=1 ctest --test-dir build/release -R records_documents
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "approved_document.h"
#include "base/criteria.h"
#include "base/files.h"
#include "described_schema.h"
#include "records/manifest.h"
#include "records/picture_index.h"
#include "records/record.h"
#include "records/trial_ends.h"

namespace relign::records {
namespace {

namespace fs = std::filesystem;
using test::approve;
using test::differing_lines;
using test::pretty;
using Ordered = nlohmann::ordered_json;

const fs::path kRoot = RELIGN_SOURCE_DIR;

TEST(Documents, AFailureShowsTheDifferingLines) {
  EXPECT_EQ(differing_lines("a\nb\nc\n", "a\nB\nB\nc\n"), "\n- b\n+ B\n+ B");
  EXPECT_EQ(differing_lines("a\nc\n", "a\nb\nc\n"), "\n+ b");
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
  return {{"enum", words_of(column.one_of)}};
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
  approve_schema<Manifest>("manifest", "relign-bench results manifest",
                           "manifest.json of a results folder. results/README.md");
}

TEST(Documents, TheSchemaOfPicturesHasTheirMembers) {
  approve_schema<PictureIndex>("pictures", "relign-bench pictures",
                               "pictures/index.json of a results folder. results/README.md");
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

// What a member has: "[{name, id}]" for a list of structs, "{cpu, cores}" for one, "" for anything else.
struct Shape {
  template <class Value>
  static std::string of(const Value&) {
    if constexpr (!Described<Value>) {
      return "";
    } else {
      std::string keys;
      const Value usual{};
      Value::members(
          [&keys](const Member& member, const auto& value) {
            const std::string inner = of(value);
            keys += (keys.empty() ? "" : ", ") + std::string(member.key) + (inner.empty() ? "" : " " + inner);
          },
          usual);
      return "{" + keys + "}";
    }
  }
  static std::string of(const SceneScore&) { return of(StatedScore()); }
  static std::string of(const Difference&) { return of(StatedDifference()); }
  template <class Value>
  static std::string of(const std::optional<Value>&) {
    return of(Value());
  }
  template <class Value>
  static std::string of(const std::vector<Value>&) {
    const std::string inner = of(Value());
    return inner.empty() ? "" : "[" + inner + "]";
  }
};

TEST(Documents, TheTableOfTheManifestHasItsMembers) {
  std::string table = "| member | content |\n|---|---|\n";
  const Manifest usual;
  Manifest::members(
      [&table](const Member& member, const auto& value) {
        const std::string shape = Shape::of(value), meaning(member.meaning);
        table += "| `" + std::string(member.key) + "` | " + meaning + (meaning.empty() || shape.empty() ? "" : ": ") +
                 shape + (member.is(kLeftOut) ? " (optional)" : "") + " |\n";
      },
      usual);
  approve_table(kRoot / "results/README.md", "members of the manifest", table);
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
