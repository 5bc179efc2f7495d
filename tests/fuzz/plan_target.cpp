// Plan files with a correct hash, since an attacker can compute it.
#include <set>

#include "base/hash.h"
#include "runner/frozen_plan.h"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string text = fuzz::text_of(data, size);
  if (Json content = parsed_json(text); content.is_object()) {
    for (const char* key : {"format", "plan", "program", "suite_file", "suite_folder"})
      if (content.contains(key)) content.erase(key);
    Json whole = parsed_json(text);
    try {
      whole["plan"] = short_hash(canonical_json(content));
      text = whole.dump();
    } catch (const Json::exception&) {  // bytes that are no UTF-8
    }
  }
  const std::filesystem::path file = fuzz::scratch_folder() / "plan.json";
  fuzz::write_scratch(file, text);
  fuzz::accepted([&] {
    const runner::FrozenPlan plan = runner::read_plan(file);
    std::size_t trials = 0;
    for (unsigned shard = 0; shard < plan.shards; ++shard) trials += runner::ids_of_shard(plan, shard).size();
    fuzz::demand(trials == plan.trials, "every trial in one part");
  });
  return 0;
}
