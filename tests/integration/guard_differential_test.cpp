// SPDX-License-Identifier: Apache-2.0
// The guard reads a message as Fast DDS does: what it lets through, Fast DDS's own code finds the
// same submessages and parameters in.

#include <arpa/inet.h>
#include <fastdds/rtps/RTPSDomain.h>
#include <fastdds/rtps/attributes/HistoryAttributes.h>
#include <fastdds/rtps/attributes/ReaderAttributes.h>
#include <fastdds/rtps/history/ReaderHistory.h>
#include <fastdds/rtps/messages/CDRMessage.h>
#include <fastdds/rtps/participant/RTPSParticipant.h>
#include <fastdds/rtps/reader/RTPSReader.h>
#include <fastdds/rtps/reader/ReaderListener.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <mutex>
#include <random>
#include <set>

#include "../rtps/mutate.hpp"
#include "domain.hpp"
#include "rtps_guard/guard.hpp"
#include "rtps_guard/parameters.hpp"

// Exported by the library, declared in none of its public headers.
namespace eprosima::fastdds::dds {
class ParameterList {
 public:
  static bool updateCacheChangeFromInlineQos(fastrtps::rtps::CacheChange_t& change,
                                             fastrtps::rtps::CDRMessage_t* msg, uint32_t& qos_size);
  static bool read_guid_from_cdr_msg(fastrtps::rtps::CDRMessage_t& msg, uint16_t search_pid,
                                     fastrtps::rtps::GUID_t& guid);
};
}  // namespace eprosima::fastdds::dds

namespace crane::dds {
namespace {

namespace rtps = eprosima::fastrtps::rtps;
using test::Datagram;
using test::Rtps;

TEST(GuardDifferential, FastDdsReadsTheParametersThatTheGuardReads) {
  const Datagram seeds[] = {Rtps::cat({Rtps::parameter(0x70, Datagram(16, 3)),
                                       Rtps::parameter(0x71, {0, 0, 0, 1}),
                                       Rtps::parameter(0x800F, Datagram(24, 4)),
                                       {1, 0, 0, 0},
                                       Datagram(40, 9)}),
                            Rtps::cat({Rtps::parameter(0x05, Rtps::string("topic")),
                                       Rtps::parameter(0x71, {0, 0, 0, 3}),
                                       Rtps::parameter(0x8123, Datagram(12, 5)),
                                       Rtps::parameter(0, Datagram(8, 0)),
                                       Rtps::parameter(0x70, Datagram(16, 8)),
                                       {1, 0, 8, 0},
                                       Datagram(12, 9)})};
  std::mt19937 random(1);
  int same = 0, refused = 0;
  for (int i = 0; i < 200'000; ++i) {
    Datagram d = seeds[random() % std::size(seeds)];
    for (auto n = random() % 3; n > 0; --n)
      d[random() % d.size()] =
          static_cast<std::uint8_t>(random() % 2 == 0 ? random() : 4 * (random() % 8));
    if (random() % 4 == 0) d.resize(random() % d.size());
    guard::Cursor cursor(d, true);
    guard::ParameterWalk walk(cursor);
    rtps::InstanceHandle_t key;
    auto kind = rtps::ALIVE;
    for (guard::Parameter p; walk.next(p);) {
      if (p.id == guard::kPidKeyHash)
        std::copy_n(p.value.begin(), 16, static_cast<rtps::octet*>(key.value));
      if (p.id != guard::kPidStatusInfo) continue;
      if (p.value[3] == 1) kind = rtps::NOT_ALIVE_DISPOSED;
      if (p.value[3] == 2) kind = rtps::NOT_ALIVE_UNREGISTERED;
      if (p.value[3] == 3) kind = rtps::NOT_ALIVE_DISPOSED_UNREGISTERED;
    }
    if (walk.refusal() != guard::Refusal::kNone) {
      ++refused;
      continue;
    }
    rtps::CDRMessage_t message(0);
    message.wraps = true;
    message.buffer = d.data();
    message.length = message.max_size = static_cast<uint32_t>(d.size());
    message.msg_endian = rtps::LITTLEEND;
    rtps::CacheChange_t change;
    change.kind = rtps::ALIVE;
    uint32_t read = 0;
    ASSERT_TRUE(eprosima::fastdds::dds::ParameterList::updateCacheChangeFromInlineQos(
        change, &message, read));
    ASSERT_EQ(read, cursor.at());
    ASSERT_EQ(message.pos, cursor.at());
    ASSERT_EQ(change.instanceHandle, key);
    ASSERT_EQ(change.kind, kind);
    ++same;
  }
  EXPECT_GT(same, 50'000);
  EXPECT_GT(refused, 20'000);
}

/// Numbers of the samples that one reader got.
class Listener final : public rtps::ReaderListener {
 public:
  void onNewCacheChangeAdded(rtps::RTPSReader* reader,
                             const rtps::CacheChange_t* const change) override {
    {
      const std::lock_guard lock(mutex_);
      got_.insert(change->sequenceNumber.to64long());
    }
    reader->getHistory()->remove_change(const_cast<rtps::CacheChange_t*>(change));
  }
  std::set<std::uint64_t> got() {
    const std::lock_guard lock(mutex_);
    return got_;
  }

 private:
  std::mutex mutex_;
  std::set<std::uint64_t> got_;
};

/// Reads what stands in a datagram at its user port, without a guard before it.
class BareReader {
 public:
  static constexpr std::uint32_t kDomain = 34;
  BareReader() {
    rtps::RTPSParticipantAttributes attributes;
    attributes.builtin.discovery_config.discoveryProtocol = rtps::DiscoveryProtocol_t::NONE;
    attributes.builtin.use_WriterLivelinessProtocol = false;
    rtps::Locator_t at;
    at.kind = LOCATOR_KIND_UDPv4;
    rtps::IPLocator::setIPv4(at, "127.0.0.1");
    at.port = port();
    attributes.defaultUnicastLocatorList.push_back(at);
    participant_ = rtps::RTPSDomain::createParticipant(kDomain, attributes);
    rtps::HistoryAttributes history;
    history.payloadMaxSize = 4096;
    history_ = std::make_unique<rtps::ReaderHistory>(history);
    rtps::ReaderAttributes reader;
    reader.endpoint.setEntityID(0x12);
    reader.endpoint.reliabilityKind = rtps::BEST_EFFORT;
    reader_ = rtps::RTPSDomain::createRTPSReader(participant_, reader, history_.get(), &listener);
    reader_->enableMessagesFromUnkownWriters(true);
  }
  ~BareReader() {
    rtps::RTPSDomain::removeRTPSReader(reader_);
    rtps::RTPSDomain::removeRTPSParticipant(participant_);
  }
  BareReader(const BareReader&) = delete;
  BareReader& operator=(const BareReader&) = delete;
  [[nodiscard]] static std::uint16_t port() { return 7400 + 250 * kDomain + 111; }
  [[nodiscard]] bool works() const { return reader_ != nullptr; }
  /// Big-endian, as in a submessage.
  [[nodiscard]] Datagram entity() const {
    const auto& id = reader_->getGuid().entityId.value;
    return Datagram(std::begin(id), std::end(id));
  }

  Listener listener;

 private:
  rtps::RTPSParticipant* participant_ = nullptr;
  std::unique_ptr<rtps::ReaderHistory> history_;
  rtps::RTPSReader* reader_ = nullptr;
};

/// Submessages of many kinds, sizes and byte orders, DATA of rising numbers among them.
Datagram made_up(std::mt19937& random, const Datagram& reader, std::uint64_t& number) {
  Datagram d = Rtps(Rtps::kMe, random() % 2 == 0 ? 0x0110 : 0x010F);
  for (auto n = 1 + random() % 6; n > 0; --n) {
    const bool little = random() % 3 != 0;
    std::uint8_t id = 0x15, flags = 0;
    Datagram body;
    static constexpr std::uint8_t kOthers[] = {0x01, 0x01, 0x09, 0x0E, 0x81, 0x90, 0x0C};
    if (random() % 2 == 0) {
      flags = 4;
      const auto put = [&](std::uint64_t v, int bytes) {
        for (int i = 0; i < bytes; ++i)
          body.push_back(static_cast<std::uint8_t>(v >> (8 * (little ? i : bytes - 1 - i))));
      };
      ++number;
      put(0, 2);
      put(16, 2);
      body.insert(body.end(), reader.begin(), reader.end());
      body.insert(body.end(), {0, 0, 0x12, 3});
      put(number >> 32U, 4);
      put(number & 0xFFFFFFFFU, 4);
      body.resize(body.size() + 4 * (1 + random() % 8), 0);
    } else {
      id = kOthers[random() % std::size(kOthers)];
      if (id == 0x09 && random() % 2 == 0) flags = 2;
      const std::size_t size = id == 0x09   ? (flags != 0 ? 0 : 8)
                               : id == 0x0E ? 12
                               : id == 0x0C ? 20
                                            : 4 * (random() % 6);
      body.assign(size, 0);
    }
    std::size_t length = body.size();
    if (random() % 12 == 0) length = random() % (body.size() + 9);  // another than there is
    if (random() % 12 == 0) body.resize(length);
    d.insert(d.end(), {id, std::uint8_t(flags | (little ? 1 : 0)),
                       std::uint8_t(little ? length & 255U : length >> 8U),
                       std::uint8_t(little ? length >> 8U : length & 255U)});
    d.insert(d.end(), body.begin(), body.end());
    if (random() % 10 == 0) d.resize(d.size() + random() % 4, 0);
  }
  return d;
}

TEST(GuardDifferential, FastDdsReceivesTheSamplesOfTheSubmessagesThatTheGuardSees) {
  BareReader reader;
  ASSERT_TRUE(reader.works());
  const int out = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(BareReader::port());
  std::mt19937 random(2);
  std::uint64_t number = 0;
  std::set<std::uint64_t> seen;
  int refused = 0, unaligned = 0, sent = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Datagram d = made_up(random, reader.entity(), number);
    guard::Guard guard;
    guard::Verdict verdict;
    guard.check(d, 0x7F000001, guard::Clock::now(), verdict);
    unaligned += verdict.refusal == guard::Refusal::kUnaligned ? 1 : 0;
    if (verdict.refusal != guard::Refusal::kNone) {
      ++refused;
      continue;
    }
    guard::MessageWalk walk(d);
    bool mine = true;  // INFO_DST of nobody leaves it so
    for (guard::Submessage s; walk.next(s);) {
      if (s.id != guard::kData || !mine) continue;
      guard::Cursor c(s.body, s.little());
      c.skip(12);
      seen.insert(c.sequence());
    }
    ASSERT_GT(sendto(out, d.data(), d.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
    // A socket buffer holds these few: on a busy machine too, none is lost but by the reader.
    if (++sent % 50 != 0) continue;
    ASSERT_TRUE(test::eventually([&] { return reader.listener.got() == seen; }))
        << reader.listener.got().size() << " of " << seen.size() << " after message " << i;
  }
  close(out);
  EXPECT_TRUE(test::eventually([&] { return reader.listener.got() == seen; }))
      << reader.listener.got().size() << " of " << seen.size();
  EXPECT_GT(seen.size(), 5000U);
  EXPECT_GT(refused, 1000);
  EXPECT_GT(unaligned, 100);
}

}  // namespace
}  // namespace crane::dds
