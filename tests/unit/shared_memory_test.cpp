#include "dds/shared_memory.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <unistd.h>

#include <fstream>

#include "temp_folder.hpp"

namespace crane::dds {
namespace {

namespace fs = std::filesystem;

void touch(const std::string& path) {
  std::ofstream(path) << "x";
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
  fs::last_write_time(shm / "fastrtps_port7415",
                      fs::file_time_type::clock::now() - std::chrono::seconds(5));
  touch(shm / "somebody_elses_file");
  const int held = open((shm / "fastrtps_port7413_el").c_str(), O_RDWR);
  ASSERT_EQ(flock(held, LOCK_SH | LOCK_NB), 0);

  EXPECT_EQ(remove_stale_segments(shm.path()), 2U + 2U + 4U + 1U);

  for (const char* stays : {"cranemap_lock_aaaa", "fast_datasharing_aaaa.0.1.3_0.0.1.3",
                            "fast_datasharing_cccc.0.1.3_0.0.1.3", "fastrtps_port7413",
                            "fastrtps_port7413_el", "fastrtps_port7417", "somebody_elses_file"})
    EXPECT_TRUE(fs::exists(shm / stays)) << stays;
  EXPECT_EQ(std::distance(fs::directory_iterator(shm.path()), fs::directory_iterator()), 7);
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
