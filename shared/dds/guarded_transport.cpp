#include "dds/guarded_transport.hpp"

#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <string>
#include <utility>
#include <vector>

#include "base/log.hpp"
#include "base/loop_watch.hpp"
#include "dds/rtps_check.hpp"

namespace crane::dds {
namespace {

namespace ert = eprosima::fastdds::rtps;
namespace rtps = eprosima::fastrtps::rtps;

constexpr std::chrono::seconds kHandledWithin{10};  ///< handshakes of a whole plant at once

constexpr std::uint32_t kLargestMessage = 65'536;  ///< as of UDP; Fast DDS sends 65,500 at most

class Descriptor final : public ert::ChainingTransportDescriptor {
 public:
  Descriptor(std::shared_ptr<ert::TransportDescriptorInterface> low,
             std::shared_ptr<GuardCounts> counts)
      : ChainingTransportDescriptor(std::move(low)), counts_(std::move(counts)) {}
  ert::TransportInterface* create_transport() const override;
  [[nodiscard]] const std::shared_ptr<GuardCounts>& counts() const { return counts_; }

 private:
  std::shared_ptr<GuardCounts> counts_;
};

class Transport final : public ert::ChainingTransport {
 public:
  explicit Transport(const Descriptor& descriptor)
      : ChainingTransport(descriptor), descriptor_(descriptor) {}
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
    const bool shared = kind() == LOCATOR_KIND_SHM;
    const char* flaw = shared && size > kLargestMessage ? "is larger than any message" : nullptr;
    if (shared && flaw == nullptr) {
      copied.assign(buffer, buffer + size);
      buffer = copied.data();
    }
    if (flaw == nullptr) flaw = check_.flaw({buffer, size});
    if (flaw == nullptr) return hand_on(next, buffer, size, local, remote);
    const std::uint64_t refused = ++descriptor_.counts()->refused;
    if (refused == 1 || refused % 100'000 == 0)
      log_warning("datagram refused: " + std::string(flaw) + " (" + std::to_string(refused) +
                  " so far)");
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

  Descriptor descriptor_;
  RtpsCheck check_;
};

ert::TransportInterface* Descriptor::create_transport() const {
  return new Transport(*this);
}

}  // namespace

std::shared_ptr<ert::TransportDescriptorInterface> guarded(
    std::shared_ptr<ert::TransportDescriptorInterface> transport,
    std::shared_ptr<GuardCounts> counts) {
  return std::make_shared<Descriptor>(std::move(transport), std::move(counts));
}

}  // namespace crane::dds
