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

/// Ports of shared memory that processes of ours listen at.
std::set<std::uint32_t> claimed() {
  static const std::string kPrefix = "cranemap_port_";
  std::set<std::uint32_t> out;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/shm"))
    if (const std::string name = entry.path().filename(); name.starts_with(kPrefix))
      out.insert(static_cast<std::uint32_t>(std::stoul(name.substr(kPrefix.size()))));
  return out;
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
  const std::set<std::uint32_t> before = claimed();
  Wakeup wakeup;
  auto receiver = *Participant::create(test::settings(), "receiver");
  std::set<std::uint32_t> ports = claimed();
  std::erase_if(ports, [&before](std::uint32_t port) { return before.contains(port); });
  ASSERT_EQ(ports.size(), 1U) << "another process started meanwhile";
  auto sender = *Participant::create(test::settings(), "sender");
  auto writer = *Writer<MapStatusTopic>::create(sender);
  auto reader = *Reader<MapStatusTopic>::create(receiver, &wakeup);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.counts().matched == 1; }));
  EXPECT_EQ(receiver->refused_datagrams(), 0U);

  RawSender raw(*ports.begin());
  std::uint64_t sent = 0;
  const std::vector<rtps::octet> header = {'R', 'T', 'P', 'S', 2, 2, 1, 15, 1,  2,
                                           3,   4,   5,   6,   7, 8, 9, 10, 11, 12};
  for (std::uint8_t length = 40; length < 80; ++length, ++sent) {
    // Statistics with four bytes more than they say: one such ends an unguarded process.
    std::vector<rtps::octet> bytes = header;
    bytes.insert(bytes.end(), {0x80, 1, length, 0});
    bytes.resize(bytes.size() + length + 4U);
    raw.send(bytes);
  }
  raw.send({'R', 'T', 'P'});
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

/// Segments for messages ("fastrtps_" and 16 digits) that this process has mapped.
std::set<std::string> segments() {
  std::set<std::string> out;
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);)
    if (const std::size_t at = line.find("/dev/shm/fastrtps_");
        at != std::string::npos && line.find("_port", at) == std::string::npos)
      out.insert(line.substr(at, line.find(' ', at) - at));
  return out;
}

/// Its sender is gone, its memory cleared, before the first message was taken.
TEST(SharedMemoryGuard, AMessageWhoseSegmentIsGoneKeepsNobodyFromTheNext) {
  const std::set<std::uint32_t> before = claimed();
  auto receiver = *Participant::create(test::settings(), "receiver");
  std::set<std::uint32_t> ports = claimed();
  std::erase_if(ports, [&before](std::uint32_t port) { return before.contains(port); });
  ASSERT_EQ(ports.size(), 1U) << "another process started meanwhile";
  auto reader = *Reader<MapStatusTopic>::create(receiver, nullptr);
  {
    const std::set<std::string> others = segments();
    RawSender raw(*ports.begin());
    for (const std::string& name : segments())
      if (!others.contains(name)) std::filesystem::remove(name);
    raw.send({'R', 'T', 'P', 'S'});
    EXPECT_TRUE(eventually([&] { return receiver->refused_datagrams() > 0; }));
  }
  auto sender = *Participant::create(test::settings(), "sender");
  auto writer = *Writer<MapStatusTopic>::create(sender);
  v1::MapStatus status;
  status.crane(1);
  status.voxel_m(0.1);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.counts().matched == 1; }));
  ASSERT_TRUE(writer.write(status));
  EXPECT_TRUE(eventually([&] { return reader.take() != nullptr; }));
}

}  // namespace
}  // namespace crane::dds
