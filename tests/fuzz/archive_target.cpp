// Archives of submissions: whatever is in one, only files of its folder are written, within the limits.
#include <filesystem>

#include "submissions/archive.h"
#include "target.h"

using namespace relign;
namespace fs = std::filesystem;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fs::path place = fuzz::scratch_folder() / "place";
  fs::create_directories(place);
  fuzz::write_scratch(place / "a.tar.gz", fuzz::text_of(data, size));
  submissions::ArchiveLimits limits;
  limits.entries = 20;
  limits.file_bytes = 100'000;
  limits.total_bytes = 200'000;
  const bool unpacked = fuzz::accepted([&] { submissions::unpack_archive(place / "a.tar.gz", place / "out", limits); });
  fuzz::demand(fs::exists(place / "out") == unpacked, "a folder exactly if the archive was accepted");
  std::uintmax_t total = 0;
  std::size_t entries = 0;
  if (unpacked)
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(place / "out")) {
      fuzz::demand(!entry.is_symlink() && (entry.is_regular_file() || entry.is_directory()), "only files and folders");
      fuzz::demand(submissions::path_mistake(entry.path().lexically_relative(place / "out"), limits).empty(),
                   "a plain path");
      if (entry.is_regular_file()) total += entry.file_size();
      if (entry.is_regular_file()) ++entries;
    }
  fuzz::demand(total <= limits.total_bytes && entries <= limits.entries, "the limits");
  fs::remove_all(place / "out");
  fuzz::demand(std::distance(fs::directory_iterator(place), fs::directory_iterator()) == 1,
               "nothing beside the folder");
  return 0;
}
