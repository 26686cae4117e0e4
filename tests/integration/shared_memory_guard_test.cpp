// SPDX-License-Identifier: Apache-2.0
// What comes through shared memory is checked as what comes over UDP is.

#include <fastdds/rtps/transport/TransportInterface.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <gtest/gtest.h>
#include <fastdds/rtps/common/LocatorList.hpp>

#include <filesystem>
#include <fstream>
#include <set>

#include "domain.hpp"

namespace crane::dds {
namespace {

namespace ert = eprosima::fastdds::rtps;
namespace rtps = eprosima::fastrtps::rtps;
using test::eventually;

/// Files of Fast DDS in shared memory that this process has mapped, of which the name goes on so.
std::set<std::string> mapped(const std::string& prefix) {
  std::set<std::string> out;
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);)
    if (const std::size_t at = line.find("/dev/shm/" + prefix); at != std::string::npos)
      out.insert(line.substr(at, line.find(' ', at) - at));
  return out;
}

/// Those with which somebody who was just made begins.
std::set<std::string> new_since(const std::set<std::string>& before, const std::string& prefix) {
  std::set<std::string> now = mapped(prefix);
  std::erase_if(now, [&before](const std::string& name) { return before.contains(name); });
  return now;
}

constexpr const char* kPort = "fastrtps_port";

/// A participant and the port at which it listens.
std::pair<std::shared_ptr<Participant>, std::uint32_t> participant_with_port() {
  const std::set<std::string> before = mapped(kPort);
  auto participant = *Participant::create(test::settings(), "receiver");
  const std::set<std::string> ports = new_since(before, kPort);
  EXPECT_EQ(ports.size(), 1U);
  const std::string name = ports.empty() ? "/dev/shm/fastrtps_port0" : *ports.begin();
  return {participant, static_cast<std::uint32_t>(
                           std::stoul(name.substr(std::string("/dev/shm/").size() + 13)))};
}

/// Sends bytes to a port as Fast DDS sends messages.
class RawSender {
 public:
  explicit RawSender(std::uint32_t port) {
    EXPECT_TRUE(transport_->init());
    to_.kind = LOCATOR_KIND_SHM;
    to_.port = port;
    to_.address[0] = 'U';
    EXPECT_TRUE(transport_->OpenOutputChannel(senders_, to_));
  }
  void send(const std::vector<rtps::octet>& bytes) {
    ert::LocatorList list;
    list.push_back(to_);
    ert::Locators begin(list.begin()), end(list.end());
    EXPECT_TRUE(senders_.front()->send(bytes.data(), static_cast<std::uint32_t>(bytes.size()),
                                       &begin, &end,
                                       std::chrono::steady_clock::now() + std::chrono::seconds(1)));
  }

 private:
  std::unique_ptr<ert::TransportInterface> transport_{
      ert::SharedMemTransportDescriptor().create_transport()};
  rtps::Locator_t to_;
  ert::SendResourceList senders_;
};

TEST(SharedMemoryGuard, MalformedMessagesAreRefusedAndTheRestComesOnce) {
  Wakeup wakeup;
  const auto [receiver, port] = participant_with_port();
  auto sender = *Participant::create(test::settings(), "sender");
  auto writer = *Writer<MapStatusTopic>::create(sender);
  auto reader = *Reader<MapStatusTopic>::create(receiver, &wakeup);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.counts().matched == 1; }));
  EXPECT_EQ(receiver->refused_datagrams(), 0U);

  RawSender raw(port);
  std::uint64_t sent = 0;
  const std::vector<rtps::octet> header = {'R', 'T', 'P', 'S', 2, 2, 1, 15, 1,  2,
                                           3,   4,   5,   6,   7, 8, 9, 10, 11, 12};
  for (std::uint8_t length = 56; length < 96; ++length, ++sent) {
    // Statistics with four bytes more than they say: such as these end an unguarded process. (Of
    // 52 the sending transport takes them for its own and removes them.)
    std::vector<rtps::octet> bytes = header;
    bytes.insert(bytes.end(), {0x80, 1, length, 0});
    bytes.resize(bytes.size() + length + 4U);
    raw.send(bytes);
  }
  raw.send(std::vector<rtps::octet>(64, 'x'));
  ++sent;
  EXPECT_TRUE(eventually([&] { return receiver->refused_datagrams() >= sent; }))
      << receiver->refused_datagrams();

  v1::MapStatus status;
  status.crane(1);
  status.voxel_m(0.1);
  for (std::uint64_t n = 1; n <= 10; ++n) {
    status.revision(n);
    ASSERT_TRUE(writer.write(status));
    std::unique_ptr<Received<v1::MapStatus>> sample;
    ASSERT_TRUE(eventually([&] { return (sample = reader.take()) != nullptr; }));
    EXPECT_EQ((*sample)->revision(), n);
  }
  EXPECT_EQ(receiver->refused_datagrams(), sent);
}

/// Its sender is gone, its memory cleared, before the first message was taken.
TEST(SharedMemoryGuard, AMessageWhoseSegmentIsGoneKeepsNobodyFromTheNext) {
  const auto [receiver, port] = participant_with_port();
  const std::vector<rtps::octet> garbage(64, 'x');
  {
    const std::set<std::string> others = mapped("fastrtps_");
    RawSender raw(port);
    const std::set<std::string> its = new_since(others, "fastrtps_");
    ASSERT_EQ(its.size(), 1U);
    std::filesystem::remove(*its.begin());
    raw.send(garbage);
  }
  RawSender next(port);
  next.send(garbage);
  const auto& guard = receiver;
  EXPECT_TRUE(eventually([&guard] { return guard->refused_datagrams() > 0; }));
}

}  // namespace
}  // namespace crane::dds
