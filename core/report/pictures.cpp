#include "report/pictures.h"

#include <algorithm>

#include "base/error.h"
#include "base/files.h"
#include "base/json_members.h"
#include "records/record.h"
#include "report/escape.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostProblems = 10;
constexpr std::uintmax_t kMostFileBytes = 64'000'000;

unsigned big_endian(const std::string& bytes, std::size_t at) {
  unsigned value = 0;
  for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

// Width and height stand at fixed places of a PNG's first chunk.
std::optional<Picture> png(const std::string& bytes) {
  static const std::string kSignature("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", 16);
  if (bytes.size() < 33 || bytes.compare(0, kSignature.size(), kSignature) != 0) return {};
  Picture picture;
  picture.width = big_endian(bytes, 16);
  picture.height = big_endian(bytes, 20);
  if (picture.width == 0 || picture.height == 0) return {};
  picture.data_uri = "data:image/png;base64," + base64(bytes);
  return picture;
}

class Loader {
 public:
  Loader(const fs::path& folder, std::size_t most_bytes, Gallery& gallery)
      : folder_(folder), most_bytes_(most_bytes), gallery_(gallery) {}

  void embed(Frame& frame) {
    if (frame.file.empty()) return;
    const auto known = by_file_.find(frame.file);
    if (known != by_file_.end()) {
      frame.picture = known->second;
      return;
    }
    frame.picture = read(frame.file);
    by_file_[frame.file] = frame.picture;
  }

  void complain(const std::string& problem) {
    if (gallery_.problems.size() < kMostProblems) gallery_.problems.push_back(problem);
  }

 private:
  std::optional<std::size_t> read(const std::string& file) {
    std::error_code failed;
    const fs::path root = fs::weakly_canonical(folder_ / "pictures", failed);
    const fs::path path = fs::weakly_canonical(folder_ / file, failed);
    const auto [root_end, unused] = std::mismatch(root.begin(), root.end(), path.begin(), path.end());
    if (failed || root_end != root.end()) {
      complain(file + ": refused, because it lies outside pictures/");
      return {};
    }
    if (!fs::is_regular_file(path, failed) || fs::file_size(path, failed) > kMostFileBytes || failed) {
      complain(file + ": no such picture");
      return {};
    }
    std::string bytes;
    try {
      bytes = read_file(path);
    } catch (const Error& error) {
      complain(error.what());
      return {};
    }
    std::optional<Picture> picture = png(bytes);
    if (!picture) {
      complain(file + ": this is no PNG picture");
      return {};
    }
    // The start frame of one instance is the same for every method.
    const auto same = by_content_.find(picture->data_uri);
    if (same != by_content_.end()) return same->second;
    if (used_ + picture->data_uri.size() > most_bytes_) {
      ++gallery_.left_out;
      return {};
    }
    used_ += picture->data_uri.size();
    const std::size_t index = gallery_.pictures.size();
    by_content_[picture->data_uri] = index;
    gallery_.pictures.push_back(std::move(*picture));
    return index;
  }

  fs::path folder_;
  std::size_t most_bytes_;
  Gallery& gallery_;
  std::size_t used_ = 0;
  std::map<std::string, std::optional<std::size_t>> by_file_;
  std::map<std::string, std::size_t> by_content_;
};

Frame frame_of(const Json& entry) {
  Frame frame;
  frame.step = count_of(entry, "step");
  const std::string file = text_of(entry, "file");
  if (!file.empty()) frame.file = "pictures/" + file;
  return frame;
}

void read_index(const Json& index, Gallery& gallery) {
  for (const Json& entry : list_of(index, "references")) gallery.references[text_of(entry, "scene")] = frame_of(entry);
  for (const Json& entry : list_of(index, "trials")) {
    const Json& frames = list_of(entry, "frames");
    if (frames.empty()) continue;
    TrialPictures trial;
    trial.trial = text_of(entry, "trial");
    trial.scene = text_of(entry, "scene");
    trial.noise_level = text_of(entry, "noise_level");
    trial.protocol = text_of(entry, "protocol");
    trial.algorithm = text_of(entry, "algorithm");
    trial.why = text_of(entry, "why");
    trial.instance = count_of(entry, "instance");
    trial.last_capture = text_of(entry, "shows") == "last_capture";
    trial.start = frame_of(frames.front());
    trial.end = frame_of(frames.back());
    gallery.trials.push_back(std::move(trial));
  }
}

}  // namespace

Gallery load_gallery(const fs::path& results, std::size_t most_bytes) {
  Gallery gallery;
  Loader loader(results, most_bytes, gallery);
  const fs::path index_path = results / "pictures" / "index.json";
  std::error_code ignored;
  if (!fs::exists(index_path, ignored)) return gallery;
  try {
    const Json index = JsonSource::from_file(index_path).root();
    records::check_format(index, "pictures/index.json");
    read_index(index, gallery);
  } catch (const Error& error) {
    loader.complain(error.what());
    return gallery;
  }
  // What convinces most comes first, should the limit bite.
  for (auto& [scene, reference] : gallery.references) loader.embed(reference);
  for (const char* why : {"median", "worst", "best"})
    for (TrialPictures& trial : gallery.trials)
      if (trial.why == why) {
        loader.embed(trial.end);
        loader.embed(trial.start);
      }
  return gallery;
}

}  // namespace relign::report
