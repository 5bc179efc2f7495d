// Manifests of submissions, and the lock files beside them.
#include "submissions/archive.h"
#include "submissions/environment_lock.h"
#include "submissions/submission.h"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  fuzz::accepted([&] {
    const submissions::Submission found =
        submissions::read_submission(JsonSource::from_text(text, submissions::kManifestName));
    fuzz::demand(found.name.find_first_of("/\\\n\x1b <>\"'") == std::string::npos, "a name for files and addresses");
    fuzz::demand(!found.authors.empty() && !found.licence.empty() && !found.use.empty(), "whole");
    for (const std::string& path : {found.plugin, found.environment})
      fuzz::demand(path.empty() || submissions::path_mistake(path).empty(), "a path in the archive");
    fuzz::demand(found.use.front() != '/' && found.use.find("../") == std::string::npos, "an algorithm in the archive");
    fuzz::demand(found.parameters.is_object() && found.text == text, "verbatim");
  });
  fuzz::accepted([&] {
    for (const auto& [name, version] : submissions::read_lock(text, "requirements.lock"))
      fuzz::demand(!name.empty() && !version.empty(), "name and version");
  });
  return 0;
}
