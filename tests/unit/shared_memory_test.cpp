// SPDX-License-Identifier: Apache-2.0
#include "dds/shared_memory.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>

#include "temp_folder.hpp"

namespace crane::dds {
namespace {

namespace fs = std::filesystem;

/// A file, made long ago.
void touch(const std::string& path) {
  std::ofstream(path) << "x";
  fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::seconds(5));
}

void make_young(const std::string& path) {
  fs::last_write_time(path, fs::file_time_type::clock::now());
}

TEST(StaleSegments, OfDeadProcessesGoAndThoseOfLivingOnesStay) {
  const test::TempFolder shm;
  const HeldFile living = mark_segments("aaaa", shm.path());
  touch(shm / "fast_datasharing_aaaa.0.1.3_0.0.1.3");
  touch(shm / "cranemap_lock_bbbb");  // a lock file that nobody holds: its owner was killed
  touch(shm / "fast_datasharing_bbbb.0.1.3_0.0.1.3");
  touch(shm / "fast_datasharing_cccc.0.1.3_0.0.1.3");  // of a process that is none of ours
  touch(shm / "fastrtps_1234");
  touch(shm / "fastrtps_1234_el");
  touch(shm / "fastrtps_port7411");
  touch(shm / "fastrtps_port7411_el");
  touch(shm / "fastrtps_port7411_sl");
  touch(shm / "sem.fastrtps_port7411_mutex");
  touch(shm / "fastrtps_port7413");
  touch(shm / "fastrtps_port7413_el");
  touch(shm / "fastrtps_port7415");  // no lock file, and nobody has it mapped: abandoned
  touch(shm / "fastrtps_port7417");  // likewise, but so young that its lock may be coming
  make_young(shm / "fastrtps_port7417");
  touch(shm / "somebody_elses_file");
  touch(shm / "fastrtps_5678");  // made, not locked yet
  touch(shm / "fastrtps_5678_el");
  make_young(shm / "fastrtps_5678_el");
  const int held = open((shm / "fastrtps_port7413_el").c_str(), O_RDWR);
  ASSERT_EQ(flock(held, LOCK_SH | LOCK_NB), 0);

  EXPECT_EQ(remove_stale_segments(shm.path()), 2U + 2U + 4U + 1U);

  for (const char* stays :
       {"cranemap_lock_aaaa", "fast_datasharing_aaaa.0.1.3_0.0.1.3",
        "fast_datasharing_cccc.0.1.3_0.0.1.3", "fastrtps_port7413", "fastrtps_port7413_el",
        "fastrtps_port7417", "fastrtps_5678", "fastrtps_5678_el", "somebody_elses_file"})
    EXPECT_TRUE(fs::exists(shm / stays)) << stays;
  EXPECT_EQ(std::distance(fs::directory_iterator(shm.path()), fs::directory_iterator()), 9);
  close(held);
}

TEST(StaleSegments, ALockGoesWithItsOwner) {
  const test::TempFolder shm;
  {
    const HeldFile lock = mark_segments("dddd", shm.path());
    EXPECT_FALSE(fs::is_empty(shm.path()));
  }
  EXPECT_TRUE(fs::is_empty(shm.path()));
}

/// Runs a function in a process of another PID namespace, to which ours does not exist: as one
/// container is to the other. Returns what the function does; -1 where that is not allowed.
int in_another_container(const std::function<int()>& function) {
  const pid_t outer = fork();
  if (outer == 0) {
    if (unshare(CLONE_NEWPID | CLONE_NEWNS) != 0) _exit(255);
    const pid_t inner = fork();
    if (inner == 0) {
      if (mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
          mount("proc", "/proc", "proc", 0, nullptr) != 0)
        _exit(255);
      _exit(function());
    }
    int status = 0;
    waitpid(inner, &status, 0);
    _exit(WIFEXITED(status) ? WEXITSTATUS(status) : 255);
  }
  int status = 0;
  waitpid(outer, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) != 255 ? WEXITSTATUS(status) : -1;
}

/// A file of ours that is mapped as long as this lives, its descriptor closed: as Fast DDS has it.
class Mapped {
 public:
  explicit Mapped(const std::string& path) {
    const int file = open(path.c_str(), O_RDWR | O_CLOEXEC);
    memory_ = mmap(nullptr, 1, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    EXPECT_NE(memory_, MAP_FAILED);
  }
  ~Mapped() { munmap(memory_, 1); }
  Mapped(const Mapped&) = delete;
  Mapped& operator=(const Mapped&) = delete;

 private:
  void* memory_;
};

TEST(StaleSegments, APortThatOnlyAnotherContainerHasOpenStays) {
  const test::TempFolder shm;
  touch(shm / "fastrtps_port7411");
  touch(shm / "fastrtps_port7411_el");
  const auto remove = [&shm] { return static_cast<int>(remove_stale_segments(shm.path())); };
  {
    const Mapped in_ours(shm / "fastrtps_port7411");
    const int removed = in_another_container(remove);
    if (removed < 0) GTEST_SKIP() << "no PID namespaces for this user";
    EXPECT_EQ(removed, 0);
  }
  EXPECT_EQ(in_another_container(remove), 2);  // and nobody has it open now
}

/// Its owner was stopped for a second between making the lock and taking it: another, younger one
/// took the lock for an abandoned one. Cleared under a living process, its mutexes and condition
/// variables are made anew beneath those who wait for them.
TEST(StaleSegments, ASegmentThatSomebodyHasOpenStaysWhateverItsLockSays) {
  const test::TempFolder shm;
  for (const char* name :
       {"fastrtps_1234", "fastrtps_1234_el", "fastrtps_5678", "fastrtps_5678_el",
        "cranemap_lock_aaaa", "fast_datasharing_aaaa_1", "fast_datasharing_aaaa_2"})
    touch(shm / name);
  {
    const Mapped segment(shm / "fastrtps_1234"), pool(shm / "fast_datasharing_aaaa_1");
    EXPECT_EQ(remove_stale_segments(shm.path()), 3U);
    for (const char* stays :
         {"fastrtps_1234", "fastrtps_1234_el", "fast_datasharing_aaaa_1", "cranemap_lock_aaaa"})
      EXPECT_TRUE(fs::exists(shm / stays)) << stays;
  }
  EXPECT_EQ(remove_stale_segments(shm.path()), 4U);
}

TEST(StaleSegments, APortThatSomebodyIsAboutToOpenStays) {
  const test::TempFolder shm;
  touch(shm / "fastrtps_port7411");
  touch(shm / "fastrtps_port7411_el");
  touch(shm / "sem.fastrtps_port7411_mutex");
  {
    const Mapped waits(shm / "sem.fastrtps_port7411_mutex");
    EXPECT_EQ(remove_stale_segments(shm.path()), 0U);
  }
  EXPECT_EQ(remove_stale_segments(shm.path()), 3U);
}

TEST(StaleSegments, OfAnotherUserStayAndTheirNamesAreSkipped) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give files away";
  const test::TempFolder shm;
  const auto give_away = [](const std::string& path) {
    touch(path);
    EXPECT_EQ(chown(path.c_str(), 65534, 65534), 0);
  };
  touch(shm / "cranemap_lock_aaaa");
  for (const char* name :
       {"fastrtps_12", "fastrtps_12_el", "fastrtps_port7411", "fastrtps_port7411_el",
        "cranemap_lock_bbbb", "fast_datasharing_aaaa_1", "fast_datasharing_bbbb_1",
        "cranemap_port_1000000", "fastrtps_port1000001", "sem.fastrtps_port1000002_mutex",
        "fastrtps_port1000003_el"})
    give_away(shm / name);
  ASSERT_EQ(symlink("/nowhere", (shm / "fastrtps_port1000004").c_str()), 0);
  ASSERT_EQ(mkfifo((shm / "cranemap_port_1000005").c_str(), 0666), 0);
  EXPECT_EQ(remove_stale_segments(shm.path()), 1U);  // the lock of ours
  const auto port = claim_shm_port(shm.path());
  ASSERT_TRUE(port);
  EXPECT_EQ(port->number, 1'000'006U);
}

TEST(ShmPorts, AreOpenAsLongAsSomebodyListens) {
  const test::TempFolder shm;
  EXPECT_FALSE(is_port_open(7411, shm.path()));
  touch(shm / "fastrtps_port7411");
  touch(shm / "fastrtps_port7411_el");
  EXPECT_FALSE(is_port_open(7411, shm.path()));  // of a killed one
  const int listens = open((shm / "fastrtps_port7411_el").c_str(), O_RDONLY);
  ASSERT_EQ(flock(listens, LOCK_EX | LOCK_NB), 0);
  EXPECT_TRUE(is_port_open(7411, shm.path()));
  close(listens);
}

TEST(Segments, AreUsedOnlyIfNobodyElseCanWriteThem) {
  const test::TempFolder shm;
  const auto used = [&shm](const char* name) {
    const int file = open((shm / name).c_str(), O_RDONLY | O_NONBLOCK);
    const bool is = use_segment(name, file);
    close(file);
    return is;
  };
  touch(shm / "ours");
  EXPECT_TRUE(used("ours"));
  ASSERT_EQ(chmod((shm / "ours").c_str(), 0666), 0);
  EXPECT_FALSE(used("ours"));
  ASSERT_EQ(mkfifo((shm / "fifo").c_str(), 0600), 0);
  EXPECT_FALSE(used("fifo"));
  if (geteuid() != 0) return;
  touch(shm / "theirs");
  ASSERT_EQ(chown((shm / "theirs").c_str(), 65534, 65534), 0);
  EXPECT_FALSE(used("theirs"));
}

TEST(ShmPorts, AreNotThoseOfTheLivingNorOfKilledListenersThatSomeoneHasOpen) {
  const test::TempFolder shm;
  const auto first = claim_shm_port(shm.path());
  ASSERT_TRUE(first);
  const auto second = claim_shm_port(shm.path());
  ASSERT_TRUE(second);
  EXPECT_NE(first->number, second->number);
  const std::uint32_t killed = second->number + 1;
  const std::string port = shm / ("fastrtps_port" + std::to_string(killed));
  touch(port);
  touch(port + "_el");                                       // whose lock nobody holds
  touch(shm / ("cranemap_port_" + std::to_string(killed)));  // nor that of its claim
  {
    const int file = open(port.c_str(), O_RDWR);
    void* opened = mmap(nullptr, 1, PROT_READ, MAP_SHARED, file, 0);
    ASSERT_NE(opened, MAP_FAILED);
    EXPECT_EQ(remove_stale_segments(shm.path()), 0U);
    const auto third = claim_shm_port(shm.path());
    ASSERT_TRUE(third);
    EXPECT_EQ(third->number, killed + 1);
    munmap(opened, 1);
    close(file);
  }
  EXPECT_EQ(remove_stale_segments(shm.path()), 3U);
  const auto again = claim_shm_port(shm.path());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->number, killed);
  // Who ends in an orderly way leaves a port that the next one may have, open or not.
  touch(shm / ("fastrtps_port" + std::to_string(killed + 1)));
  const auto next = claim_shm_port(shm.path());
  ASSERT_TRUE(next);
  EXPECT_EQ(next->number, killed + 1);
  EXPECT_FALSE(claim_shm_port("/nowhere"));
}

TEST(SharedMemoryCheck, SaysHowMuchIsMissingAndWhatToDo) {
  EXPECT_TRUE(check_shared_memory(1, "/tmp"));
  const auto small = check_shared_memory(1ULL << 60U, "/tmp");
  ASSERT_FALSE(small);
  EXPECT_NE(small.error().todo.find("--shm-size"), std::string::npos);
  EXPECT_FALSE(check_shared_memory(1, "/nowhere"));
}

}  // namespace
}  // namespace crane::dds
