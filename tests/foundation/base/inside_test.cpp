#include "base/inside.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/files.h"

namespace relign {
namespace {

namespace fs = std::filesystem;

TEST(LiesInside, ResolvesParentsAndLinks) {
  const fs::path root = fs::temp_directory_path() / ("inside_test_" + std::to_string(::getpid()));
  const fs::path folder = root / "folder";
  write_file_atomically(folder / "below/file.txt", "a");
  write_file_atomically(root / "folder-beside/file.txt", "b");
  fs::create_symlink("below/file.txt", folder / "stays.txt");
  fs::create_symlink("../folder-beside/file.txt", folder / "leaves.txt");
  fs::create_directory_symlink(root / "folder-beside", folder / "door");
  EXPECT_TRUE(is_inside(folder / "below/file.txt", folder));
  EXPECT_TRUE(is_inside(folder / "below/../stays.txt", folder));
  EXPECT_TRUE(is_inside(folder / "not/yet/there", folder));
  EXPECT_TRUE(is_inside(folder, folder));
  EXPECT_FALSE(is_inside(folder / "leaves.txt", folder));
  EXPECT_FALSE(is_inside(folder / "door/file.txt", folder));
  EXPECT_FALSE(is_inside(folder / "door/not_there.txt", folder));
  EXPECT_FALSE(is_inside(folder / "../folder-beside/file.txt", folder));
  EXPECT_FALSE(is_inside("/etc/passwd", folder));
  fs::remove_all(root);
}

}  // namespace
}  // namespace relign
