#include "records/processor.h"

#include "base/json_members.h"

namespace relign::records {

bool same_processor(const Json& one, const Json& other) {
  const bool both = !text_of(one, "instruction_sets").empty() && !text_of(other, "instruction_sets").empty();
  const char* key = both ? "instruction_sets" : "cpu";
  return text_of(one, key) == text_of(other, key);
}

}  // namespace relign::records
