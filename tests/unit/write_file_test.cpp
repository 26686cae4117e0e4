// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "base/read_file.hpp"
#include "base/write_file.hpp"
#include "temp_folder.hpp"

namespace {

namespace fs = std::filesystem;

std::string g_watched;              ///< a file of which its content is noted at each fsync
std::vector<std::string> g_synced;  ///< what was synced, and the content of the file then

std::string content(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream all;
  all << file.rdbuf();
  return all.str();
}

}  // namespace

// In place of the C library's, for this whole program: says what is on disk when.
extern "C" int fsync(int file) {
  if (!g_watched.empty())
    g_synced.push_back(fs::read_symlink("/proc/self/fd/" + std::to_string(file)).string() + ": " +
                       content(g_watched));
  return static_cast<int>(syscall(SYS_fsync, file));
}

namespace crane {
namespace {

Result<void> write(const std::string& path, const std::string& text) {
  return write_file(path, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

TEST(WriteFile, AFailingPowerLeavesTheOldFileOrTheNewOne) {
  test::TempFolder folder;
  const std::string path = folder / "zones.yaml";
  ASSERT_TRUE(write(path, "old"));
  g_watched = path;
  g_synced.clear();
  ASSERT_TRUE(write(path, "new"));
  g_watched.clear();
  EXPECT_EQ(g_synced, (std::vector<std::string>{path + ".part: old",  // the new one is on disk
                                                folder.path().string() + ": new"}));
  EXPECT_EQ(content(path), "new");
  EXPECT_FALSE(fs::exists(path + ".part"));
}

TEST(WriteFile, SeveralOfAFolderAreWaitedForOneByOneAndTheFolderOnce) {
  test::TempFolder folder;
  g_watched = folder / "b";
  g_synced.clear();
  const auto written = write_files(folder.path(), {{"a", {'1'}}, {"b", {'2'}}});
  g_watched.clear();
  ASSERT_TRUE(written);
  EXPECT_EQ(g_synced, (std::vector<std::string>{folder / "a.part: ", folder / "b.part: ",
                                                folder.path().string() + ": 2"}));
  EXPECT_EQ(content(folder / "a"), "1");
}

TEST(WriteFile, WhatCannotBeWrittenIsSaidWithTheCause) {
  const auto written = write("/proc/cranemap/zones.yaml", "new");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kResource);
  EXPECT_EQ(written.error().text(),
            "/proc/cranemap/zones.yaml: cannot be written: No such file or directory -> check "
            "permissions and free space");
}

TEST(WriteFile, AFullDiskKeepsTheOldFile) {
  test::TempFolder folder;
  const std::string disk = folder / "small";
  fs::create_directory(disk);
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0)
    GTEST_SKIP() << "this user may not mount a small file system to fill";
  ASSERT_TRUE(write(disk + "/zones.yaml", "old"));
  const auto written = write(disk + "/zones.yaml", std::string(100'000, 'x'));
  const std::string kept = content(disk + "/zones.yaml");
  const bool partial = fs::exists(disk + "/zones.yaml.part");
  umount(disk.c_str());
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().text().find("No space left on device"), std::string::npos)
      << written.error().text();
  EXPECT_EQ(kept, "old");
  EXPECT_FALSE(partial);
}

TEST(ReadFile, SaysWhatIsInTheWay) {
  const test::TempFolder folder;
  const auto code = [](const std::string& path) { return read_file(path, 10).error().code; };
  std::ofstream(folder / "ten") << "0123456789";
  ASSERT_TRUE(read_file(folder / "ten", 10));
  EXPECT_EQ(*read_file(folder / "ten", 10), "0123456789");
  EXPECT_EQ(read_file(folder / "ten", 9).error().code, ErrorCode::kBadData);
  EXPECT_EQ(code(folder / "none"), ErrorCode::kNotAvailable);
  EXPECT_EQ(code(folder / "ten/none"), ErrorCode::kNotAvailable);
  EXPECT_EQ(code(folder.path()), ErrorCode::kBadData);
  ASSERT_EQ(mkfifo((folder / "fifo").c_str(), 0600), 0);
  EXPECT_EQ(code(folder / "fifo"), ErrorCode::kBadData);  // and nobody waits for its other end
  EXPECT_EQ(*read_file("/proc/self/comm", 100), "unit_tests\n");  // of size 0, it says
  EXPECT_TRUE(*is_there(folder / "ten"));
  EXPECT_FALSE(*is_there(folder / "none"));
  EXPECT_FALSE(*is_folder(folder / "ten"));
  EXPECT_TRUE(*is_folder(folder.path()));
  EXPECT_FALSE(is_there(folder / std::string(300, 'n')));  // a name no disk has: not to be told
}

}  // namespace
}  // namespace crane
