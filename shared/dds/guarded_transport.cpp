// SPDX-License-Identifier: Apache-2.0
#include "dds/guarded_transport.hpp"

#include <arpa/inet.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <ifaddrs.h>

#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/log.hpp"
#include "base/loop_watch.hpp"

namespace crane::dds {
namespace {

namespace ert = eprosima::fastdds::rtps;
namespace rtps = eprosima::fastrtps::rtps;

constexpr std::chrono::seconds kHandledWithin{10};  ///< handshakes of a whole plant at once

constexpr std::uint32_t kLargestMessage = 65'536;  ///< as of UDP; Fast DDS sends 65,500 at most

class Descriptor final : public ert::ChainingTransportDescriptor {
 public:
  Descriptor(std::shared_ptr<ert::TransportDescriptorInterface> low,
             std::shared_ptr<GuardCounts> counts, std::shared_ptr<guard::Guard> guard)
      : ChainingTransportDescriptor(std::move(low)),
        counts_(std::move(counts)),
        guard_(std::move(guard)) {}
  ert::TransportInterface* create_transport() const override;
  [[nodiscard]] const std::shared_ptr<GuardCounts>& counts() const { return counts_; }
  [[nodiscard]] const std::shared_ptr<guard::Guard>& guard() const { return guard_; }

 private:
  std::shared_ptr<GuardCounts> counts_;
  std::shared_ptr<guard::Guard> guard_;
};

std::vector<guard::Ipv4> own_addresses() {
  std::vector<guard::Ipv4> out;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return out;
  for (const ifaddrs* i = all; i != nullptr; i = i->ifa_next)
    if (i->ifa_addr != nullptr && i->ifa_addr->sa_family == AF_INET)
      out.push_back(ntohl(reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr.s_addr));
  freeifaddrs(all);
  return out;
}

/// 0: it came through shared memory.
guard::Ipv4 source_of(const rtps::Locator_t& remote) {
  if (remote.kind != LOCATOR_KIND_UDPv4) return 0;
  const rtps::octet* a = remote.address + 12;
  return guard::Ipv4(a[0]) << 24U | guard::Ipv4(a[1]) << 16U | guard::Ipv4(a[2]) << 8U | a[3];
}

class Transport final : public ert::ChainingTransport {
 public:
  explicit Transport(const Descriptor& descriptor)
      : ChainingTransport(descriptor), descriptor_(descriptor), guard_(descriptor.guard()) {
    guard_->set_own_addresses(own_addresses());
  }
  /// The low one's threads use what the base class holds until they end.
  ~Transport() override { low_level_transport_.reset(); }
  void shutdown() override { low_level_transport_->shutdown(); }

  ert::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }

  /// Shared memory looks for its sender in the list and does not see it behind ours: it would add
  /// one for every peer, and each message would be sent by all of them.
  bool OpenOutputChannel(ert::SendResourceList& senders, const rtps::Locator_t& to) override {
    if (kind() == LOCATOR_KIND_SHM)
      for (const auto& sender : senders)
        if (sender->kind() == LOCATOR_KIND_SHM) return true;
    return ChainingTransport::OpenOutputChannel(senders, to);
  }

  bool send(rtps::SenderResource* low, const rtps::octet* buffer, std::uint32_t size,
            rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) override {
    return low->send(buffer, size, begin, end, timeout);
  }

  void receive(ert::TransportReceiverInterface* next, const rtps::octet* buffer, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    // The sender can still write in shared memory: what is checked has to be what is used.
    thread_local std::vector<rtps::octet> copied;
    if (kind() == LOCATOR_KIND_SHM) {
      if (size > kLargestMessage) return refuse(guard::Refusal::kLength);
      copied.assign(buffer, buffer + size);
      buffer = copied.data();
    }
    const auto now = std::chrono::steady_clock::now();
    look_at_interfaces(now);
    if (!told_self_.load(std::memory_order_relaxed) && descriptor_.counts()->has_self.load()) {
      guard_->set_self(descriptor_.counts()->self);
      told_self_ = true;
    }
    thread_local guard::Verdict verdict;
    guard_->check({buffer, size}, source_of(remote), now, verdict);
    if (verdict.refusal != guard::Refusal::kNone) return refuse(verdict.refusal);
    if (verdict.patches.empty()) {
      hand_on(next, buffer, size, local, remote);
    } else {
      thread_local std::vector<rtps::octet> patched;
      patched.assign(buffer, buffer + size);
      verdict.patches.apply(patched);
      hand_on(next, patched.data(), size, local, remote);
    }
    if (!verdict.assembled.empty())
      hand_on(next, verdict.assembled.data(), static_cast<std::uint32_t>(verdict.assembled.size()),
              local, remote);
  }

 private:
  /// What makes Fast DDS go round in a datagram for ever is seen as a thread that hangs.
  static void hand_on(ert::TransportReceiverInterface* next, const rtps::octet* buffer,
                      std::uint32_t size, const rtps::Locator_t& local,
                      const rtps::Locator_t& remote) {
    thread_local const LoopWatch::Mark kWork =
        LoopWatch::of_process().watch("Fast DDS's receiver", kHandledWithin);
    kWork.turned();
    next->OnDataReceived(buffer, size, local, remote);
    kWork.rests();
  }

  void refuse(guard::Refusal refusal) {
    GuardCounts& counts = *descriptor_.counts();
    const std::uint64_t refused = ++counts.refused;
    const std::uint64_t alike = ++counts.by_refusal.at(static_cast<std::size_t>(refusal));
    if (alike == 1 || refused % 100'000 == 0)
      log_warning("datagram refused: " + std::string(text(refusal)) + " (" + std::to_string(alike) +
                  " of this kind, " + std::to_string(refused) + " in all)");
  }

  /// Addresses come and go: looked at every few seconds, by whoever receives.
  void look_at_interfaces(std::chrono::steady_clock::time_point now) {
    const std::int64_t seconds =
        std::chrono::duration_cast<std::chrono::seconds>(now.time_since_epoch()).count();
    std::int64_t due = look_at_.load();
    if (seconds < due || !look_at_.compare_exchange_strong(due, seconds + 5)) return;
    guard_->set_own_addresses(own_addresses());
  }

  Descriptor descriptor_;
  std::shared_ptr<guard::Guard> guard_;
  std::atomic<std::int64_t> look_at_{0};
  std::atomic<bool> told_self_{false};
};

ert::TransportInterface* Descriptor::create_transport() const {
  return new Transport(*this);
}

}  // namespace

std::shared_ptr<ert::TransportDescriptorInterface> guarded(
    std::shared_ptr<ert::TransportDescriptorInterface> transport,
    std::shared_ptr<GuardCounts> counts, std::shared_ptr<guard::Guard> guard) {
  return std::make_shared<Descriptor>(std::move(transport), std::move(counts), std::move(guard));
}

}  // namespace crane::dds
