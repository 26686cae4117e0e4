// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <optional>

#include "sensors/distance/byte_link.hpp"
#include "sensors/distance/distance_source.hpp"
#include "sensors/distance/modbus_source.hpp"

namespace crane {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

/// A device that streams is asked for its health so often.
constexpr auto kHealthEvery = 1000ms;

/// Protocols over one link: the first one speaks, all of them listen.
class LinkSource final : public DistanceSource {
 public:
  explicit LinkSource(const std::vector<RangefinderConfig>& port) : config_(port.front()) {
    for (const RangefinderConfig& channel : port)
      protocols_.push_back(make_distance_protocol(channel));
  }

  Result<void> open() override {
    link_.reset();
    for (auto& protocol : protocols_) protocol->forget();
    SerialLine line = first().line();
    if (config_.baud > 0) line.baud = config_.baud;
    if (config_.parity != 0) line.parity = config_.parity;
    auto link = ByteLink::open(config_.port, line);
    if (!link) return link.error();
    link_.emplace(std::move(*link));
    asked_ = 0;
    next_question_ = Clock::now();
    return link_->write(first().begin());
  }

  Result<void> listen(std::chrono::milliseconds limit, DeviceTalk& out) override {
    if (!link_) return Error{ErrorCode::kResource, config_.port, "is not open", ""};
    const auto now = Clock::now();
    if (now >= next_question_) {
      const auto interval =
          first().is_asked() ? std::chrono::milliseconds(config_.interval_ms) : kHealthEvery;
      // Not in a burst after a pause.
      next_question_ = std::max(next_question_ + interval, now);
      if (auto sent = link_->write(first().ask(asked_++)); !sent) return sent;
    }
    const auto until_question =
        std::chrono::duration_cast<std::chrono::milliseconds>(next_question_ - Clock::now()) + 1ms;
    std::array<std::uint8_t, 512> bytes{};
    const auto got = link_->read(bytes, std::clamp(until_question, 1ms, limit));
    if (!got) return got.error();
    if (*got == 0) return {};
    for (std::size_t channel = 0; channel < protocols_.size(); ++channel) {
      const std::size_t from = out.size();
      protocols_[channel]->take(std::span(bytes).first(*got), out);
      for (std::size_t i = from; i < out.size(); ++i) out[i].channel = channel;
    }
    return {};
  }

  void close() override {
    if (link_) (void)link_->write(first().end());
    link_.reset();
  }
  [[nodiscard]] std::uint64_t damaged() const override { return first().damaged(); }
  [[nodiscard]] std::int64_t line_time_ns(std::size_t bytes) const override {
    return link_ ? link_->line_time_ns(bytes) : 0;
  }

 private:
  [[nodiscard]] DistanceProtocol& first() const { return *protocols_.front(); }
  RangefinderConfig config_;
  std::vector<std::unique_ptr<DistanceProtocol>> protocols_;
  std::optional<ByteLink> link_;
  std::uint64_t asked_ = 0;
  Clock::time_point next_question_;
};

}  // namespace

std::unique_ptr<DistanceSource> make_distance_source(const std::vector<RangefinderConfig>& port) {
  if (port.front().device == RangefinderConfig::Device::kModbus)
    return std::make_unique<ModbusSource>(port.front());
  return std::make_unique<LinkSource>(port);
}

}  // namespace crane
