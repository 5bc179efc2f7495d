// Broken files: every mutation of the golden files ends in a lens or in an error that names the file.
//   RELIGN_FUZZ_INPUTS=1000000 build/asan/tests/test_simulator_lens_files --gtest_filter='MutatedFiles.*'
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "golden_lens.h"
#include "lens_files/completion.h"
#include "lens_files/scene_layout.h"

namespace relign::lens_files {
namespace {

using Random = std::mt19937_64;

struct Seed {
  std::string name, bytes;
};

std::vector<Seed> seeds() {
  std::vector<Seed> all;
  for (const char* name : {"cooke_triplet_utf16.zmx", "cooke_triplet_latin1.zmx", "cooke_triplet_utf8.zmx",
                           "cooke_triplet.seq", "relign_od.lis", "cooke.agf"})
    all.push_back({name, golden_bytes(name)});
  all.push_back({"small.zmx", small_zmx("  TYPE EVENASPH\n  PARM 2 1e-6\n", "UNIT IN\n")});
  all.push_back({"small.seq", small_seq("ASP; K 1; A 1e-7; XDE 0.1; ADE 1; DAR", "DIM I")});
  return all;
}

std::size_t below(Random& random, std::size_t count) {
  return count == 0 ? 0 : static_cast<std::size_t>(random() % count);
}

std::string mutated(Random& random, std::string bytes, const std::string& other) {
  static const std::vector<std::string> kWords = {"-1",
                                                  "1e30",
                                                  "1e-320",
                                                  "0",
                                                  "INFINITY",
                                                  "nan",
                                                  "SURF 3\n",
                                                  "STOP\n",
                                                  "STO\n",
                                                  "TYPE COORDBRK\n",
                                                  "PARM 1 1e20\n",
                                                  "S 1 1 X\n",
                                                  "SI\n",
                                                  "PRV\n",
                                                  ";",
                                                  "&",
                                                  "'",
                                                  ":",
                                                  "CURV 1e9\n",
                                                  "DISZ -1e9\n",
                                                  "GLAS X\n",
                                                  "\xFF\xFE",
                                                  "CIR S2 -3\n",
                                                  "PWAV 99999999999\n",
                                                  "REF -1\n",
                                                  "DIM C\n",
                                                  "FTYP 1\n",
                                                  "K : 1e6\n"};
  const std::size_t changes = 1 + below(random, 4);
  for (std::size_t i = 0; i < changes; ++i) {
    const std::size_t at = below(random, bytes.size() + 1);
    switch (random() % 8) {
      case 0:
        bytes.resize(at);
        break;
      case 1:
        if (at < bytes.size()) bytes[at] = static_cast<char>(random());
        break;
      case 2:
        bytes.insert(at, kWords[below(random, kWords.size())]);
        break;
      case 3:
        bytes.erase(at, below(random, 40));
        break;
      case 4:
        bytes.insert(at, bytes.substr(below(random, bytes.size()), below(random, 200)));
        break;
      case 5:
        bytes.insert(at, other.substr(below(random, other.size()), below(random, 200)));
        break;
      case 6:  // another digit: files that stay readable, lenses that do not
        for (std::size_t k = at; k < bytes.size(); ++k)
          if (bytes[k] >= '0' && bytes[k] <= '9') {
            bytes[k] = static_cast<char>('0' + random() % 10);
            break;
          }
        break;
      default:
        if (at < bytes.size()) bytes[at] = "-+.eE;:\n\0 '\""[random() % 12];
    }
  }
  return bytes;
}

// What `scene new` does, short of writing; without rays, which cost a hundred times as much, up to the elements.
void whole_way(const std::string& bytes, const std::string& name, bool with_rays) {
  if (name.find(".agf") != std::string::npos) {
    read_agf(bytes, name);
    return;
  }
  GlassSources any;
  any.is_known = [](const std::string&) { return false; };
  LensDesign design = read_design(bytes, name);
  // Unknown glass names would all end here: replaces them, so that later stages are tested too.
  for (Surface& surface : design.surfaces)
    if (!surface.glass.empty() && surface.index == 0) surface.index = 1.6;
  for (Surface& surface : design.surfaces)
    if (surface.nd > 0) surface.vd = 0;
  const LensDraft draft = draft_lens(design, any, "fuzz", 0);
  remark_lines(design);
  if (!with_rays) return;
  LayoutChoices choices;
  choices.name = "fuzz";
  const CompleteLens lens = complete_lens(design, draft);
  const Layout layout = lay_out(design, lens, choices);
  readme(design, lens, choices, layout);
}

std::uint64_t inputs_wanted() {
  const char* wanted = std::getenv("RELIGN_FUZZ_INPUTS");
  return wanted ? std::strtoull(wanted, nullptr, 10) : 3000;
}

TEST(MutatedFiles, GiveALensOrAnErrorThatNamesTheFile) {
  const std::vector<Seed> all = seeds();
  constexpr std::uint64_t kRaysEvery = 20;
  std::uint64_t lenses = 0, errors = 0;
  for (std::uint64_t i = 0; i < inputs_wanted(); ++i) {
    Random random(i);
    const Seed& seed = all[below(random, all.size())];
    const std::string bytes = mutated(random, seed.bytes, all[below(random, all.size())].bytes);
    try {
      whole_way(bytes, seed.name, i % kRaysEvery == 0);
      ++lenses;
    } catch (const Error& error) {
      ++errors;
      const std::string text = error.what();
      ASSERT_EQ(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::bad_input))
          << "input " << i << ": " << text;
      ASSERT_NE(text.find(seed.name), std::string::npos) << "input " << i << ": " << text;
    } catch (const std::exception& error) {
      FAIL() << "input " << i << " of " << seed.name << ": " << error.what();
    }
  }
  RecordProperty("lenses", static_cast<int>(lenses));
  // Both must happen, or the mutations reach nothing.
  EXPECT_GT(lenses, inputs_wanted() / 50);
  EXPECT_GT(errors, inputs_wanted() / 50);
}

TEST(MutatedFiles, TruncationsGiveALensOrAnError) {
  for (const Seed& seed : seeds())
    for (std::size_t length = 0; length < seed.bytes.size(); length += 1 + seed.bytes.size() / 400) try {
        whole_way(seed.bytes.substr(0, length), seed.name, length % 8 == 0);
      } catch (const Error& error) {
        ASSERT_NE(std::string(error.what()).find(seed.name), std::string::npos) << length << ": " << error.what();
      }
}

}  // namespace
}  // namespace relign::lens_files
