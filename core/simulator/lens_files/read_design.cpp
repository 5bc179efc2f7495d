#include "lens_files/read_design.h"

#include "base/files.h"
#include "lens_files/listing_reader.h"
#include "lens_files/seq_reader.h"
#include "lens_files/text_lines.h"
#include "lens_files/zmx_reader.h"

namespace relign::lens_files {
namespace {

bool ends_with(const std::string& name, const std::string& ending) {
  return name.size() >= ending.size() && name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
}

}  // namespace

LensDesign read_design(std::string_view bytes, const std::string& file) {
  LensDesign design = read_design_with_problems(bytes, file);
  throw_if_any(design.problems);
  return design;
}

LensDesign read_design_with_problems(std::string_view bytes, const std::string& file, int configuration) {
  const std::string name = upper_case(file);
  if (ends_with(name, ".ZMX")) return read_zmx_with_problems(bytes, file, configuration);
  if (ends_with(name, ".SEQ")) return read_seq_with_problems(bytes, file, configuration);
  if (ends_with(name, ".ZAR") || ends_with(name, ".ZOS") || ends_with(name, ".LEN"))
    throw Error(ErrorKind::bad_input, file +
                                          ": archives and binary lens files are not supported; save the lens as .zmx "
                                          "(Zemax) or .seq (CODE V)");
  for (const TextLine& line : text_lines(bytes, file)) {
    const std::vector<std::string> words = words_of(line.text);
    if (words.empty()) continue;
    const std::string first = upper_case(words[0]), text = upper_case(line.text);
    if (first == "RDY" && text.find("THI") != std::string::npos) {
      if (configuration > 1)
        throw Error(ErrorKind::bad_input,
                    file + ": a listing has one configuration; --configuration is for .zmx and .seq");
      return read_listing_with_problems(bytes, file);
    }
    if (first == "SURF") return read_zmx_with_problems(bytes, file, configuration);
    if (first == "SO" || first == "S" || first == "RDM" || first == "RDM;" || first == "LEN")
      return read_seq_with_problems(bytes, file, configuration);
  }
  throw Error(ErrorKind::bad_input, file +
                                        ": unknown lens file format; supported are Zemax .zmx, CODE V .seq, and CODE V "
                                        "listings (with a line RDY THI RMD GLA)");
}

std::string bytes_of(const std::filesystem::path& file) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (!error && size > kMaxBytes)
    throw Error(ErrorKind::bad_input, file.string() + ": the file has " + std::to_string(size >> 20) +
                                          " MB; lens and glass files have at most " + std::to_string(kMaxBytes >> 20));
  return read_file(file);
}

}  // namespace relign::lens_files
