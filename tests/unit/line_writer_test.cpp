// SPDX-License-Identifier: Apache-2.0
#include "base/line_writer.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <sstream>
#include <string>

#include "base/loop_watch.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

/// Lives as long as the process, as the log's does.
LineWriter& writer_to(int fd) {
  return *new LineWriter(fd, 100,
                         [](std::uint64_t count) { return std::to_string(count) + " left out\n"; });
}

TEST(LineWriter, APipeThatNobodyReadsHoldsNobodyUpAndWhatIsLeftOutIsSaid) {
  int pipe_ends[2];
  ASSERT_EQ(pipe2(pipe_ends, O_CLOEXEC), 0);
  const int capacity = fcntl(pipe_ends[1], F_SETPIPE_SZ, 4096);
  ASSERT_GT(capacity, 0);
  LineWriter& writer = writer_to(pipe_ends[1]);
  const std::string line(999, 'x');
  const int lines = 300 + capacity / 1000;
  for (int i = 0; i < lines; ++i) writer.put(line + "\n");  // would never return
  EXPECT_FALSE(writer.flush(50ms));
  EXPECT_GT(writer.left_out(), 100U);
  EXPECT_LE(writer.left_out(), std::size_t(lines) - 100) << "a hundred are kept";

  // In one line or, where the writer got a turn amid the puts, in several.
  std::string read_back;
  const auto said_left_out = [&] {
    std::uint64_t sum = 0;
    std::istringstream all(read_back);
    for (std::string one; std::getline(all, one);)
      if (one.ends_with(" left out")) sum += std::stoull(one);
    return sum;
  };
  while (!read_back.ends_with(" left out\n") || said_left_out() < writer.left_out()) {
    pollfd ready{pipe_ends[0], POLLIN, 0};
    ASSERT_EQ(poll(&ready, 1, 20'000), 1) << "said without another line: " << said_left_out();
    char bytes[4096];
    const ssize_t n = read(pipe_ends[0], bytes, sizeof bytes);
    ASSERT_GT(n, 0);
    read_back.append(bytes, static_cast<std::size_t>(n));
  }
  EXPECT_EQ(said_left_out(), writer.left_out());
  std::size_t whole = 0;
  for (std::size_t at = 0; (at = read_back.find(line + "\n", at)) != std::string::npos; ++at)
    ++whole;
  EXPECT_EQ(whole + writer.left_out(), std::size_t(lines)) << "in order, none cut, none twice";
  writer.put("one more\n");
  EXPECT_TRUE(writer.flush(20s));
}

TEST(LineWriter, AReaderThatIsGoneEndsNothing) {
  int pipe_ends[2];
  ASSERT_EQ(pipe2(pipe_ends, O_CLOEXEC), 0);
  LineWriter& writer = writer_to(pipe_ends[1]);
  close(pipe_ends[0]);
  for (int i = 0; i < 10; ++i) writer.put("to nobody\n");  // no SIGPIPE in its thread
  EXPECT_TRUE(writer.flush(20s));
}

TEST(LoopWatch, SaysWhichLoopDoesNotTurnUntilItDoesAgain) {
  LoopWatch::Clock::time_point now{};
  LoopWatch watch([&] { return now; });
  const auto slow = watch.watch("writer", 10s);
  const auto quick = watch.watch("heartbeat", 2s);
  EXPECT_EQ(watch.trouble(), "");
  now += 3s;
  slow.turned();
  EXPECT_EQ(watch.trouble(), "heartbeat hangs: nothing done for 3 s");
  quick.turned();
  EXPECT_EQ(watch.trouble(), "");
  quick.rests();  // it has nothing to do, and may take its time
  now += 11s;
  ASSERT_EQ(watch.stalled().size(), 1U);
  EXPECT_EQ(watch.stalled()[0].name, "writer");
  quick.turned();
  now += 3s;
  EXPECT_EQ(watch.stalled().size(), 2U);
}

TEST(LoopWatch, AThreadThatEndedIsNotMissed) {
  LoopWatch::Clock::time_point now{};
  LoopWatch watch([&] { return now; });
  { const auto gone = watch.watch("gone", 1s); }
  now += 10s;
  EXPECT_TRUE(watch.stalled().empty());
}

}  // namespace
}  // namespace crane
