// Rays over the polynomial faces of a folder's lens files against bisection. Lens files of others are not part of this
// repository: RELIGN_CORPUS=FOLDER names one, RELIGN_CORPUS_RAYS how many rays a face [default: 100].
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>

#include "base/error.h"
#include "lens_files/completion.h"
#include "lens_files/read_design.h"
#include "optics/assembly.h"
#include "optics/face_crossings.h"
#include "optics/glass.h"

namespace relign::lens_files {
namespace {

namespace fs = std::filesystem;

TEST(CorpusFaces, IntersectionsMatchBisection) {
  const char* const folder = std::getenv("RELIGN_CORPUS");
  if (!folder) GTEST_SKIP() << "RELIGN_CORPUS names no folder of lens files";
  const char* const wanted = std::getenv("RELIGN_CORPUS_RAYS");
  const int rays = wanted ? std::atoi(wanted) : 100;
  std::set<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".zmx" || entry.path().extension() == ".ZMX") files.insert(entry.path());
  GlassSources sources;
  sources.from_file = true;
  sources.is_known = [](const std::string& name) {
    return optics::find_glass(name) != nullptr || optics::glass_of_code(name).has_value();
  };
  int read = 0, faces = 0;
  optics::Crossings sum;
  for (const fs::path& file : files) {
    CompleteLens made;
    try {
      LensDesign design = read_design_with_problems(bytes_of(file), file.filename().string());
      made = complete_lens(design, draft_lens(design, sources, "lens", 0, false));
    } catch (const Error&) {
      continue;  // rejected files have no faces to test
    }
    ++read;
    const optics::Assembly assembly(made.lens);
    const optics::BackwardPath path = optics::backward_path(assembly, {});
    std::vector<const optics::Op*> ops;  // of aspheres and conics, from the image on
    for (const optics::Op& op : path.ops)
      if (op.kind == optics::Op::asphere) ops.push_back(&op);
    std::size_t behind = ops.size();
    for (std::size_t e = 0; e < made.lens.elements.size(); ++e)
      for (std::size_t f = 0; f < made.lens.elements[e].faces.size(); ++f) {
        const optics::Face& face = made.lens.elements[e].faces[f];
        if (!face.is_sphere()) --behind;
        if (face.is_conic()) continue;
        const std::string what =
            file.filename().string() + " " + made.lens.elements[e].name + " face " + std::to_string(f + 1);
        const auto seed = static_cast<std::uint64_t>(++faces);
        optics::compare_with_bisection(face, rays, seed, what, sum);
        optics::compare_blocks(optics::block_kernels(), *ops[behind], face,
                               assembly.bounds(e, f, optics::Apertures::mesh), 10 * rays, seed, what, sum);
        if (HasFatalFailure()) return;
      }
  }
  std::printf(
      "%zu files, %d lenses, %d polynomial faces: %ld hits, %ld misses, %ld grazing, %ld shallow, %ld of several "
      "crossings; %ld rays of blocks\n",
      files.size(), read, faces, sum.hits, sum.misses, sum.grazing, sum.shallow, sum.several, sum.in_blocks);
  EXPECT_GT(faces, 0) << "no lens file of " << folder << " has a polynomial";
}

}  // namespace
}  // namespace relign::lens_files
