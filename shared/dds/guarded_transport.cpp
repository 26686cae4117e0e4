#include "dds/guarded_transport.hpp"

#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>

#include <string>
#include <utility>

#include "base/log.hpp"
#include "base/loop_watch.hpp"
#include "dds/rtps_check.hpp"

namespace crane::dds {
namespace {

namespace ert = eprosima::fastdds::rtps;
namespace rtps = eprosima::fastrtps::rtps;

constexpr std::chrono::seconds kHandledWithin{10};  ///< handshakes of a whole plant at once

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
  /// TCP's threads use what the base class holds until they are told to end; it does not tell them.
  ~Transport() override { low_level_transport_.reset(); }
  void shutdown() override { low_level_transport_->shutdown(); }

  ert::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }

  bool send(rtps::SenderResource* low, const rtps::octet* buffer, std::uint32_t size,
            rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) override {
    return low->send(buffer, size, begin, end, timeout);
  }

  void receive(ert::TransportReceiverInterface* next, const rtps::octet* buffer, std::uint32_t size,
               const rtps::Locator_t& local, const rtps::Locator_t& remote) override {
    const char* flaw = check_.flaw({buffer, size});
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
