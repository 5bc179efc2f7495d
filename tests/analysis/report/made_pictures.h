// Small pictures, and the pictures/index.json of a results folder.
#pragma once

#include <string>

#include "base/files.h"
#include "records/picture_index.h"
#include "report/made_results.h"

namespace relign::report {

// A 2 x 2 checkerboard; `tail` makes a different file of the same picture.
inline std::string made_png(const std::string& tail = "") {
  static const unsigned char kBytes[] = {
      0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00,
      0x00, 0x02, 0x00, 0x00, 0x00, 0x02, 0x08, 0x00, 0x00, 0x00, 0x00, 0x57, 0xdd, 0x52, 0xf8, 0x00, 0x00, 0x00,
      0x0c, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x60, 0xf8, 0x0f, 0x84, 0x00, 0x06, 0x00, 0x01, 0xff, 0xad,
      0x2c, 0x37, 0x25, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
  return std::string(reinterpret_cast<const char*>(kBytes), sizeof kBytes) + tail;
}

// Three tiles of 2 x 2 pixels: lossless and lossy WebP, as libwebp writes them.
inline std::string made_film() {
  static const unsigned char kBytes[] = {0x52, 0x49, 0x46, 0x46, 0x20, 0x00, 0x00, 0x00, 0x57, 0x45,
                                         0x42, 0x50, 0x56, 0x50, 0x38, 0x4c, 0x14, 0x00, 0x00, 0x00,
                                         0x2f, 0x05, 0x40, 0x00, 0x00, 0x0f, 0x30, 0xff, 0xf3, 0x3f,
                                         0xff, 0xf3, 0x1f, 0x78, 0x78, 0x85, 0x4a, 0x44, 0xff, 0x23};
  return std::string(reinterpret_cast<const char*>(kBytes), sizeof kBytes);
}
inline std::string made_lossy_film() {
  static const unsigned char kBytes[] = {0x52, 0x49, 0x46, 0x46, 0x46, 0x00, 0x00, 0x00, 0x57, 0x45, 0x42, 0x50, 0x56,
                                         0x50, 0x38, 0x20, 0x3a, 0x00, 0x00, 0x00, 0x90, 0x01, 0x00, 0x9d, 0x01, 0x2a,
                                         0x06, 0x00, 0x02, 0x00, 0x02, 0xc0, 0x4c, 0x25, 0xa4, 0x00, 0x02, 0x9d, 0x47,
                                         0x23, 0x50, 0x00, 0xce, 0x3a, 0x53, 0xf6, 0xff, 0xfd, 0xe0, 0x9e, 0xcc, 0x0d,
                                         0xff, 0xf2, 0x2b, 0xfb, 0x6b, 0x1e, 0xff, 0xca, 0x5c, 0x54, 0x4f, 0x79, 0x3e,
                                         0x02, 0xd8, 0xfb, 0x0b, 0x5f, 0xd3, 0x2d, 0xfa, 0x5c, 0x20, 0x00, 0x00, 0x00};
  return std::string(reinterpret_cast<const char*>(kBytes), sizeof kBytes);
}

class MadePictures : public MadeResults {
 protected:
  void write_index(const Json& trials, const Json& references = Json::array()) {
    const Json index = {{"format", 1}, {"trials", trials}, {"references", references}};
    write_file_atomically(folder_ / "pictures" / "index.json", records::completed<records::PictureIndex>(index).dump());
  }
  static Json entry(const std::string& algorithm, const std::string& why, const std::string& start,
                    const std::string& end) {
    return {{"trial", algorithm + why},
            {"scene", "relign_od"},
            {"noise_level", "rho0"},
            {"protocol", "paper"},
            {"algorithm", algorithm},
            {"instance", 1},
            {"why", why},
            {"frames", {{{"step", 0}, {"file", start}}, {{"step", 9}, {"file", end}}}}};
  }
  static Json with_film(Json entry, const std::string& file, unsigned tile = 2) {
    Json frames = Json::array();
    for (const int step : {0, 1, 9})
      frames.push_back({{"step", step},
                        {"commanded_pose", {0.25}},
                        {"true_pose", {0.1 * step}},
                        {"measured", 0.2},
                        {"commanded", 0.1},
                        {"recommended", nullptr},
                        {"machine_seconds", 0.5 * step}});
    entry["film"] = {{"file", file}, {"tile", tile}, {"frames", frames}};
    return entry;
  }
  void put(const std::string& file, const std::string& bytes) {
    write_file_atomically(folder_ / "pictures" / file, bytes);
  }
};

}  // namespace relign::report
