// Reads JSON files of users by their schema in docs/schemas, the one place that states keys, types, limits, defaults
// and meanings: the program embeds it, editors and docs use the same file.
#pragma once

#include <string>
#include <vector>

#include "base/json_source.h"

namespace relign {

class Schema {
 public:
  // An embedded file (relign_embed_file). Of JSON Schema, draft 7, it applies: type, enum, const, minimum, maximum,
  // exclusiveMinimum, minLength, maxLength, items, minItems, maxItems, uniqueItems, properties, required,
  // additionalProperties, default, $ref within the file (one to another file needs "checked elsewhere", see below); and
  // of oneOf, the alternative for the value's type. What relates several keys (not, if, anyOf) and patterns, for which
  // a sentence of their own helps more, remain to the code that reads the values. A rule with "$comment": "checked
  // elsewhere" applies to editors alone.
  Schema(const unsigned char* bytes, std::size_t size);

  // The document with the defaults of absent keys. Adds each mistake to `problems`, and replaces what is wrong or
  // missing by some allowed value, so that the values can be read and checked further.
  Json checked(const JsonSource& source, std::vector<Problem>& problems) const;
  // The same of a part of a document: the value at `pointer` by the rule at the pointer `rule` of the schema.
  Json checked(const JsonSource& source, const std::string& pointer, const std::string& rule,
               std::vector<Problem>& problems) const;

 private:
  Json root_;
};

}  // namespace relign
