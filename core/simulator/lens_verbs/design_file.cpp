#include "lens_verbs/design_file.h"

#include <cstdio>
#include <filesystem>

#include "base/error.h"
#include "base/text.h"
#include "lens_files/read_design.h"
#include "lens_files/scene_layout.h"
#include "optics/glass.h"

namespace relign::cli {
namespace {

lens_files::GlassSources glass_sources(const DesignOptions& options) {
  lens_files::GlassSources sources;
  sources.is_known = [](const std::string& name) {
    return optics::find_glass(name) != nullptr || optics::glass_of_code(name).has_value();
  };
  sources.known_like = [](const std::string& name) {
    const optics::Glass* glass = optics::find_glass_like(name);
    return glass ? glass->name : std::string();
  };
  sources.from_file = options.glass_from_file;
  for (const std::string& alias : options.aliases) sources.aliases.push_back(lens_files::parse_alias(alias));
  for (const std::string& file : options.glass_files)
    sources.catalogues.push_back({file, lens_files::read_agf(lens_files::bytes_of(file), file)});
  return sources;
}

}  // namespace

CLI::Validator from_to(double least, double most, const std::string& range) {
  return CLI::Validator(
      [least, most, range](std::string& text) {
        double value = 0;
        const bool number = CLI::detail::lexical_cast(text, value);
        return number && value >= least && value <= most ? std::string()
                                                         : "'" + text + "' must be a number from " + range;
      },
      "");
}

void add_design_options(CLI::App& verb, DesignOptions& options) {
  verb.add_option("--glass", options.glass_files, "glass catalogue (.agf) to look up glass names in; repeatable")
      ->type_name("FILE")
      ->allow_extra_args(false);
  verb.add_option("--alias", options.aliases,
                  "replace a glass name of the file by another, such as BK7=N-BK7; repeatable")
      ->type_name("NAME=NAME")
      ->allow_extra_args(false);
  verb.add_flag("--glass-from-file", options.glass_from_file,
                "for unknown glass names, use the index and Abbe number stated in the Zemax file");
  verb.add_option(
          "--configuration", options.configuration,
          "configuration (Zemax) or zoom position (CODE V), from 1 [default: the one that is active in the file]")
      ->type_name("N")
      ->check(from_to(1, 1000, "1 to 1000"));
  verb.add_option("--wavelength", options.wavelength_nm, "wavelength, nm [default: the file's reference wavelength]")
      ->type_name("NM")
      ->check(from_to(100, 1e5, "100 to 100000 nm"));
}

DesignLens read_design_lens(const std::string& file, const DesignOptions& options, const std::string& name) {
  DesignLens made;
  made.design = lens_files::read_design_with_problems(lens_files::bytes_of(file), file, options.configuration);
  const lens_files::GlassSources sources = glass_sources(options);
  made.lens = lens_files::complete_lens(
      made.design, lens_files::draft_lens(made.design, sources, name, options.wavelength_nm, options.polychromatic));
  return made;
}

void refuse_design_options(const DesignOptions& options) {
  const char* option = !options.glass_files.empty() ? "--glass"
                       : !options.aliases.empty()   ? "--alias"
                       : options.glass_from_file    ? "--glass-from-file"
                       : options.configuration > 0  ? "--configuration"
                       : options.wavelength_nm > 0  ? "--wavelength"
                                                    : nullptr;
  if (option)
    throw Error(ErrorKind::bad_input, std::string(option) +
                                          ": only for files of design programs; a relign-bench lens file contains "
                                          "its glasses and wavelength");
}

optics::Prescription lens_of_file(const std::string& file, const DesignOptions& options) {
  const std::filesystem::path path = file;
  if (path.extension() == ".json") {
    refuse_design_options(options);
    return optics::read_prescription(path);
  }
  DesignLens made = read_design_lens(file, options, path.stem().string());
  for (const std::string& remark : lens_files::remark_lines(made.design))
    std::fprintf(stderr, "%s\n", printable(remark).c_str());
  return std::move(made.lens.lens);
}

}  // namespace relign::cli
