// The lens files of tests/golden/lenses, and short ones made of lines.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "base/files.h"
#include "lens_files/read_design.h"
#include "lens_files/zmx_reader.h"

namespace relign::lens_files {

inline std::string golden_bytes(const std::string& name) {
  return read_file(std::string(RELIGN_TEST_DATA) + "/lenses/" + name);
}

inline LensDesign golden_design(const std::string& name) { return read_design(golden_bytes(name), name); }

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

// A biconvex lens of radius 50 with the stop behind it; `extra` goes into surface 1, `system` before the surfaces.
inline std::string small_zmx(const std::string& extra = "", const std::string& system = "") {
  return "MODE SEQ\nUNIT MM\nENPD 10\nFTYP 0 0 1 1\nYFLN 5\nWAVM 1 0.55 1\nPWAV 1\n" + system +
         "SURF 0\n  DISZ INFINITY\n"
         "SURF 1\n  CURV 0.02\n  DISZ 4\n  GLAS ___BLANK 1 0 1.5 0\n  DIAM 12\n" +
         extra +
         "SURF 2\n  CURV -0.02\n  DISZ 1\n  DIAM 12\n"
         "SURF 3\n  STOP\n  DISZ 47.6\n  DIAM 5\n"
         "SURF 4\n  DISZ 0\n";
}

// The same in CODE V's words: `extra` behind surface 1.
inline std::string small_seq(const std::string& extra = "", const std::string& system = "") {
  return "RDM; LEN\nEPD 10\nDIM M\nWL 550\nREF 1\nYAN 5\n" + system + "\nSO 0 1e14\nS 50 4 517642\n CIR 12\n" + extra +
         "\nS -50 1\n CIR 12\nS 0 47.6\n STO; CIR 5\nSI 0 0\n";
}

}  // namespace relign::lens_files
