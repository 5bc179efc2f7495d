#include "records/picture_index.h"

#include "base/files.h"
#include "records/record.h"

namespace relign::records {
namespace {

std::filesystem::path file_in(const std::filesystem::path& results) { return results / "pictures" / "index.json"; }

}  // namespace

PictureIndex read_picture_index(const std::filesystem::path& results) {
  const Json json = read_formatted(file_in(results));
  return json.is_null() ? PictureIndex() : read_described<PictureIndex>(json, file_in(results).string());
}

void write_picture_index(const std::filesystem::path& results, const PictureIndex& index) {
  write_file_atomically(file_in(results), json_of(index).dump(1) + "\n");
}

}  // namespace relign::records
