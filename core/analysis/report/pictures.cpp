#include "report/pictures.h"

#include <algorithm>

#include "base/error.h"
#include "base/files.h"
#include "base/inside.h"
#include "markup/escape.h"
#include "report/page_numbers.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxProblems = 10;
constexpr std::uintmax_t kMaxFileBytes = 64'000'000;

constexpr std::size_t kMaxFilmFrames = 64;
constexpr std::uint64_t kMaxTilePixels = 1024;

using Read = std::optional<Picture> (*)(const std::string& bytes);

class Loader {
 public:
  Loader(const fs::path& folder, std::size_t most_bytes, Gallery& gallery)
      : folder_(folder), most_bytes_(most_bytes), gallery_(gallery) {}

  void embed(Frame& frame) {
    if (!frame.file.empty()) frame.picture = once(frame.file, png_picture, "PNG");
  }

  // A film is one row of square tiles, one per capture in the index.
  void embed(Film& film) {
    if (film.frames.empty()) return;
    const std::optional<std::size_t> place = once(film.file, webp_picture, "WebP");
    if (!place) return;
    const Picture& picture = gallery_.pictures[*place];
    if (picture.height == film.tile && picture.width == film.tile * film.frames.size()) {
      film.picture = place;
      return;
    }
    add_problem(film.file + ": the film has " + std::to_string(picture.width) + " x " + std::to_string(picture.height) +
                " pixels, but the index lists " + std::to_string(film.frames.size()) + " tiles of " +
                std::to_string(film.tile));
  }

  void add_problem(const std::string& problem) {
    if (gallery_.problems.size() < kMaxProblems) gallery_.problems.push_back(problem);
  }

 private:
  std::optional<std::size_t> once(const std::string& file, Read read_picture, const char* format) {
    const auto known = by_file_.find(file);
    if (known != by_file_.end()) return known->second;
    return by_file_[file] = read(file, read_picture, format);
  }

  std::optional<std::size_t> read(const std::string& file, Read read_picture, const char* format) {
    std::error_code failed;
    const fs::path path = fs::weakly_canonical(folder_ / file, failed);
    if (failed || !is_inside(path, folder_ / "pictures")) {
      add_problem(file + ": rejected, since it is outside pictures/");
      return {};
    }
    if (!fs::is_regular_file(path, failed) || fs::file_size(path, failed) > kMaxFileBytes || failed) {
      add_problem(file + ": no such picture");
      return {};
    }
    std::string bytes;
    try {
      bytes = read_file(path);
    } catch (const Error& error) {
      add_problem(error.what());
      return {};
    }
    std::optional<Picture> picture = read_picture(bytes);
    if (!picture) {
      add_problem(file + ": not a valid " + format + " file");
      return {};
    }
    // The start image of an instance is the same for all methods.
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

Frame frame_of(unsigned step, const std::string& file) {
  Frame frame;
  frame.step = step;
  if (!file.empty()) frame.file = "pictures/" + file;
  return frame;
}

Film film_of(const std::optional<records::FilmEntry>& entry) {
  Film film;
  if (!entry || entry->file.empty() || entry->tile > kMaxTilePixels || entry->frames.size() > kMaxFilmFrames)
    return film;
  film.file = "pictures/" + entry->file;
  film.tile = entry->tile;
  film.frames = entry->frames;
  return film;
}

void take_index(const records::PictureIndex& index, Gallery& gallery) {
  for (const records::ReferencePicture& entry : index.references)
    gallery.references[entry.scene] = frame_of(0, entry.file);
  for (const records::PicturedTrial& entry : index.trials) {
    if (entry.frames.empty()) continue;
    TrialPictures& trial = gallery.trials.emplace_back();
    trial.trial = entry.trial;
    trial.scene = entry.scene;
    trial.noise_level = entry.noise_level;
    trial.protocol = entry.protocol;
    trial.algorithm = entry.algorithm;
    trial.why = entry.why;
    trial.instance = entry.instance;
    trial.last_capture = entry.shows == "last_capture";
    trial.start = frame_of(entry.frames.front().step, entry.frames.front().file);
    trial.end = frame_of(entry.frames.back().step, entry.frames.back().file);
    trial.film = film_of(entry.film);
  }
}

}  // namespace

Gallery load_gallery(const fs::path& results, std::size_t most_bytes, const std::vector<ShownFirst>& first) {
  Gallery gallery;
  Loader loader(results, most_bytes, gallery);
  try {
    take_index(records::read_picture_index(results), gallery);
  } catch (const Error& error) {
    loader.add_problem(error.what());
    return gallery;
  }
  // Most important first, because of the limit. A film also shows the start.
  for (auto& [scene, reference] : gallery.references) loader.embed(reference);
  for (const ShownFirst& shown : first)
    for (const char* why : {"median", "worst"})
      for (TrialPictures& trial : gallery.trials) {
        if (trial.why != why || trial.scene != shown.scene || trial.noise_level != shown.noise_level ||
            trial.protocol != shown.protocol || trial.algorithm != shown.algorithm)
          continue;
        loader.embed(trial.end);
        loader.embed(trial.film);
        if (!trial.film.picture) loader.embed(trial.start);
      }
  const auto each = [&](const auto& embed) {
    for (const char* why : {"median", "worst", "best"})
      for (TrialPictures& trial : gallery.trials)
        if (trial.why == why) embed(trial);
  };
  each([&](TrialPictures& trial) { loader.embed(trial.film); });
  each([&](TrialPictures& trial) { loader.embed(trial.end); });
  each([&](TrialPictures& trial) { loader.embed(trial.start); });
  return gallery;
}

namespace {

unsigned byte_at(const std::string& bytes, std::size_t at) { return static_cast<unsigned char>(bytes[at]); }

unsigned big_endian(const std::string& bytes, std::size_t at) {
  unsigned value = 0;
  for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | byte_at(bytes, i);
  return value;
}

unsigned little_endian(const std::string& bytes, std::size_t at, std::size_t count) {
  unsigned value = 0;
  for (std::size_t i = count; i-- > 0;) value = value << 8 | byte_at(bytes, at + i);
  return value;
}

std::optional<Picture> made(const std::string& bytes, const char* type, unsigned width, unsigned height) {
  if (width == 0 || height == 0) return {};
  return Picture{std::string("data:") + type + ";base64," + base64(bytes), width, height};
}

}  // namespace

// Width and height are at fixed offsets in the first chunk of a PNG.
std::optional<Picture> png_picture(const std::string& bytes) {
  static const std::string kSignature("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", 16);
  if (bytes.size() < 33 || bytes.compare(0, kSignature.size(), kSignature) != 0) return {};
  return made(bytes, "image/png", big_endian(bytes, 16), big_endian(bytes, 20));
}

// RFC 9649: "RIFF", size of the rest, "WEBP", then the first chunk, whose name determines where the size is stored.
std::optional<Picture> webp_picture(const std::string& bytes) {
  constexpr std::size_t kShortest = 30;
  constexpr unsigned kFourteenBits = 0x3fff;
  if (bytes.size() < kShortest || bytes.compare(0, 4, "RIFF") != 0 || bytes.compare(8, 4, "WEBP") != 0) return {};
  if (little_endian(bytes, 4, 4) > bytes.size() - 8) return {};  // truncated
  const std::string chunk = bytes.substr(12, 4);
  if (chunk == "VP8 " && bytes.compare(23, 3, "\x9d\x01\x2a") == 0)
    return made(bytes, "image/webp", little_endian(bytes, 26, 2) & kFourteenBits,
                little_endian(bytes, 28, 2) & kFourteenBits);
  if (chunk == "VP8L" && byte_at(bytes, 20) == 0x2f) {
    const unsigned extent = little_endian(bytes, 21, 4);
    return made(bytes, "image/webp", (extent & kFourteenBits) + 1, (extent >> 14 & kFourteenBits) + 1);
  }
  if (chunk == "VP8X")
    return made(bytes, "image/webp", little_endian(bytes, 24, 3) + 1, little_endian(bytes, 27, 3) + 1);
  return {};
}

}  // namespace relign::report
