// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>

#include "bounds.h"
#include "domain.hpp"

namespace crane::dds {
namespace {

using test::eventually;
using test::Transport;

/// Writer and reader in participants of their own, matched.
template <class Topic>
struct Pair {
  std::shared_ptr<Participant> sender, receiver;
  Wakeup wakeup;
  std::optional<Writer<Topic>> writer;
  std::optional<Reader<Topic>> reader;

  explicit Pair(Transport transport, std::size_t capacity = 0) {
    sender = *Participant::create(test::settings(transport), "sender");
    receiver = *Participant::create(test::settings(transport), "receiver");
    writer.emplace(*Writer<Topic>::create(sender, Topic::kName, 0, capacity));
    reader.emplace(*Reader<Topic>::create(receiver, &wakeup));
    EXPECT_TRUE(
        eventually([&] { return writer->matched() == 1 && reader->counts().matched == 1; }));
  }
  std::unique_ptr<Received<typename Topic::Type>> next() {
    std::unique_ptr<Received<typename Topic::Type>> sample;
    eventually([&] { return (sample = reader->take()) != nullptr; });
    return sample;
  }
};

class FrameDelivery : public ::testing::TestWithParam<Transport> {};

TEST_P(FrameDelivery, LoanedFramesArriveWholeAndInOrder) {
  Pair<StereoFrameTopic> pair(GetParam(), 3 * 1280 * 720);
  for (std::uint64_t n = 0; n < 20; ++n) {
    StereoFrame* frame = nullptr;
    ASSERT_TRUE(eventually([&] { return (frame = pair.writer->loan()) != nullptr; }));
    frame->crane(1);
    frame->encoding(v1::ENCODING_BGR8);
    frame->stream(3);
    frame->sequence_number(n);
    frame->exposure_time_ns(1 + TimeNs(n));
    frame->width(1280);
    frame->height(720);
    std::memset(frame->left().data(), int(n), frame->left().size());
    std::memset(frame->right().data(), int(n) + 100, frame->right().size());
    ASSERT_TRUE(pair.writer->publish(frame));
    const auto got = pair.next();
    ASSERT_NE(got, nullptr);
    EXPECT_EQ((*got)->sequence_number(), n);
    EXPECT_EQ((*got)->left().front(), n);
    EXPECT_EQ((*got)->right().back(), n + 100);
    EXPECT_EQ((*got)->right().size(), 3U * 1280 * 720);
    EXPECT_TRUE(got->intact());
    EXPECT_GT(got->source_time_ns(), 0);
  }
  EXPECT_EQ(pair.reader->counts().received, 20U);
  EXPECT_EQ(pair.reader->counts().lost, 0U);
}

INSTANTIATE_TEST_SUITE_P(Transports, FrameDelivery,
                         ::testing::Values(Transport::kAuto, Transport::kUdp));

TEST(FrameDelivery, AWriterWithZeroCopyReachesAReaderThatIsOnUdpOnly) {
  auto sender = *Participant::create(test::settings(), "sender");
  auto receiver = *Participant::create(test::settings(Transport::kUdp), "receiver");
  Wakeup wakeup;
  auto writer = *Writer<StereoFrameTopic>::create(sender, StereoFrameTopic::kName, 0, 64 * 48);
  auto reader = *Reader<StereoFrameTopic>::create(receiver, &wakeup);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.counts().matched == 1; }));
  StereoFrame* frame = writer.loan();
  ASSERT_NE(frame, nullptr);
  frame->encoding(v1::ENCODING_MONO8);
  frame->width(64);
  frame->height(48);
  frame->exposure_time_ns(5);
  frame->sequence_number(77);
  ASSERT_TRUE(writer.publish(frame));
  std::unique_ptr<Received<StereoFrame>> got;
  ASSERT_TRUE(eventually([&] { return (got = reader.take()) != nullptr; }));
  EXPECT_EQ((*got)->sequence_number(), 77U);
}

TEST_P(FrameDelivery, ImagesSmallerThanWhatWasLentArriveAsSmallAsTheyAre) {
  Pair<StereoFrameTopic> pair(GetParam(), 100'000);
  for (const std::size_t size : {100'000U, 5000U, 1U, 100'000U}) {
    StereoFrame* frame = nullptr;
    ASSERT_TRUE(eventually([&] { return (frame = pair.writer->loan()) != nullptr; }));
    frame->encoding(v1::ENCODING_JPEG);
    frame->exposure_time_ns(5);
    frame->width(640);
    frame->height(480);
    frame->left().shrink(size);
    frame->right().shrink(size - size / 3);
    std::memset(frame->left().data(), 7, frame->left().size());
    std::memset(frame->right().data(), 9, frame->right().size());
    ASSERT_TRUE(pair.writer->publish(frame));
    const auto got = pair.next();
    ASSERT_NE(got, nullptr);
    ASSERT_EQ((*got)->left().size(), size);
    ASSERT_EQ((*got)->right().size(), size - size / 3);
    EXPECT_EQ((*got)->left().back(), 7);
    EXPECT_EQ((*got)->right().front(), 9);
    EXPECT_TRUE(got->intact());
  }
}

TEST(FrameDelivery, AParticipantReadsOrWritesButNotBoth) {
  auto one = *Participant::create(test::settings(), "one");
  auto writer = Writer<StereoFrameTopic>::create(one);
  ASSERT_TRUE(writer);
  EXPECT_FALSE(Reader<StereoFrameTopic>::create(one, nullptr));
  auto other = *Participant::create(test::settings(), "other");
  auto reader = Reader<StereoFrameTopic>::create(other, nullptr);
  ASSERT_TRUE(reader);
  EXPECT_FALSE(Writer<StereoFrameTopic>::create(other));
}

TEST(FrameDelivery, AFrameThatIsWrittenOverIsNoticed) {
  Pair<StereoFrameTopic> pair(Transport::kAuto, 64 * 48);
  const auto send = [&](std::uint64_t n) {
    StereoFrame* frame = pair.writer->loan();
    if (frame == nullptr) return;
    frame->encoding(v1::ENCODING_MONO8);
    frame->width(64);
    frame->height(48);
    frame->exposure_time_ns(5);
    frame->sequence_number(n);
    (void)pair.writer->publish(frame);
  };
  send(0);
  const auto first = pair.next();
  ASSERT_NE(first, nullptr);
  EXPECT_TRUE(first->intact());
  for (std::uint64_t n = 1; n < 20; ++n) {
    send(n);
    // Not flat out: a writer that overtakes a reader which is just then looking for its next sample
    // can send that reader's listener round in circles (docs/decisions/0002).
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_FALSE(first->intact());
}

TEST(TileDelivery, ALateJoinerGetsTheLastStateOfEveryTile) {
  auto sender = *Participant::create(test::settings(), "sender");
  auto writer = *Writer<MapTileTopic>::create(sender);
  v1::MapTile tile;
  tile.crane(1);
  tile.voxel_m(0.05);
  tile.encoding(1);
  tile.payload({1, 2, 3});
  for (std::uint64_t revision = 1; revision <= 3; ++revision)
    for (int x = -50; x < 50; ++x) {
      tile.tile_x(static_cast<std::int16_t>(x));
      tile.revision(revision);
      ASSERT_TRUE(writer.write(tile));
    }
  auto receiver = *Participant::create(test::settings(), "late");
  auto reader = *Reader<MapTileTopic>::create(receiver, nullptr);
  std::map<int, std::uint64_t> got;
  eventually([&] {
    while (const auto sample = reader.take()) got[(*sample)->tile_x()] = (*sample)->revision();
    return got.size() == 100;
  });
  ASSERT_EQ(got.size(), 100U);
  for (const auto& [x, revision] : got) EXPECT_EQ(revision, 3U);
}

TEST(Participant, CranesAreKeptApart) {
  Settings other = test::settings();
  other.crane = 2;
  // Two of each crane, made crosswise: who meets the other of its own had time to meet the rest.
  auto one = *Participant::create(test::settings(), "one");
  auto two = *Participant::create(other, "two");
  auto reader_two = *Reader<MapStatusTopic>::create(two, nullptr);
  auto writer_one = *Writer<MapStatusTopic>::create(one);
  auto one_too = *Participant::create(test::settings(), "one, too");
  auto two_too = *Participant::create(other, "two, too");
  auto writer_two = *Writer<MapStatusTopic>::create(two_too);
  auto reader_one = *Reader<MapStatusTopic>::create(one_too, nullptr);
  const auto all_met = [&] {
    return writer_one.matched() > 0 && writer_two.matched() > 0 &&
           reader_one.counts().matched > 0 && reader_two.counts().matched > 0;
  };
  ASSERT_TRUE(eventually(all_met));
  const auto status_of = [](std::uint32_t crane) {
    v1::MapStatus status;
    status.crane(crane);
    status.voxel_m(0.1);
    return status;
  };
  std::size_t heard = 0;
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(writer_one.write(status_of(1)));
    ASSERT_TRUE(writer_two.write(status_of(2)));
    for (auto [reader, crane] : {std::pair{&reader_one, 1U}, std::pair{&reader_two, 2U}}) {
      std::unique_ptr<Received<v1::MapStatus>> sample;
      ASSERT_TRUE(eventually([&] { return (sample = reader->take()) != nullptr; }));
      EXPECT_EQ((*sample)->crane(), crane);
      ++heard;
    }
  }
  EXPECT_EQ(heard, 40U);
  EXPECT_EQ(writer_one.matched(), 1);
  EXPECT_EQ(writer_two.matched(), 1);
  EXPECT_EQ(reader_one.counts().matched, 1);
  EXPECT_EQ(reader_two.counts().matched, 1);
}

TEST(Participant, SaysWhatIsWrongWithItsSettings) {
  Settings s = test::settings();
  s.domain = 233;
  auto bad = Participant::create(s, "x");
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::kConfiguration);
  s = test::settings();
  s.profile_file = "/nowhere.xml";
  bad = Participant::create(s, "x");
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().where, "/nowhere.xml");
}

TEST(Participant, NoFreeUdpPortIsAnErrorThatSaysSo) {
  // Occupy what participants discover at: 7400 + 250 * domain + 10 + 2 * participant, up to the
  // next domain's. Some may be taken already.
  constexpr std::uint32_t kDomain = 99;
  constexpr int kFirst = 7400 + 250 * int(kDomain) + 10;
  std::vector<int> sockets;
  for (int port = kFirst; port < kFirst + 240; port += 2) {
    const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ASSERT_GE(s, 0);
    sockets.push_back(s);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    (void)bind(s, reinterpret_cast<sockaddr*>(&address), sizeof address);
  }
  Settings s = test::settings(Transport::kUdp);
  s.domain = kDomain;
  const auto none = Participant::create(s, "x");
  for (int socket : sockets) close(socket);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kResource);
  EXPECT_NE(none.error().what.find("no free UDP port"), std::string::npos);
}

}  // namespace
}  // namespace crane::dds
