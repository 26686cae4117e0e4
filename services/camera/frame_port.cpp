// SPDX-License-Identifier: Apache-2.0
#include "frame_port.hpp"

#include <algorithm>
#include <utility>

#include "base/log.hpp"

namespace crane {

FramePort::~FramePort() {
  if (loan_ != nullptr) writer_->discard(loan_);
}

Result<void> FramePort::grow_to(std::size_t image_bytes) {
  if (image_bytes <= capacity_) return {};
  if (writer_) {
    log_info("images of " + std::to_string(image_bytes) + " bytes, larger than those before");
    if (loan_ != nullptr) writer_->discard(std::exchange(loan_, nullptr));
    writer_.reset();
  }
  auto writer = dds::Writer<dds::StereoFrameTopic>::create(
      participant_, dds::StereoFrameTopic::kName, 0, image_bytes);
  if (!writer) return writer.error();
  writer_.emplace(std::move(*writer));
  capacity_ = image_bytes;
  return {};
}

std::optional<FrameBuffers> FramePort::buffers() {
  if (!writer_) {
    if (!own_) {
      own_ = std::make_unique<dds::StereoFrame>();
      own_->left().resize(kMaxImageBytes);
      own_->right().resize(kMaxImageBytes);
    }
    return FrameBuffers{own_->left().data(), own_->right().data(), kMaxImageBytes, kMaxImagePixels};
  }
  if (loan_ == nullptr) loan_ = writer_->loan();
  if (loan_ == nullptr) return std::nullopt;
  return FrameBuffers{loan_->left().data(), loan_->right().data(), capacity_, kMaxImagePixels};
}

Result<void> FramePort::publish(const FrameFacts& facts, std::uint64_t calibration) {
  dds::StereoFrame& frame = loan_ != nullptr ? *loan_ : *own_;
  const auto bytes = image_bytes(facts.format, facts.width, facts.height);
  frame.crane(participant_->settings().crane);
  frame.encoding(static_cast<std::uint32_t>(facts.format));
  frame.stream(facts.stream);
  frame.sequence_number(static_cast<std::uint64_t>(facts.sequence));
  frame.after(facts.after);
  frame.exposure_time_ns(facts.exposure_time);
  frame.calibration(calibration);
  frame.width(facts.width);
  frame.height(facts.height);
  frame.left().shrink(bytes.value_or(facts.left_bytes));
  frame.right().shrink(bytes.value_or(facts.right_bytes));
  if (loan_ != nullptr) return writer_->publish(std::exchange(loan_, nullptr));
  // The first one tells the size. JPEGs differ: twice a byte a pixel is more than any of them has.
  const std::size_t needed = std::max(frame.left().size(), frame.right().size());
  const std::size_t pixels = std::size_t{facts.width} * facts.height;
  if (auto made = grow_to(bytes ? needed : std::max(needed, 2 * pixels)); !made)
    return made.error();
  const auto first = std::exchange(own_, nullptr);
  return writer_->write(*first);
}

}  // namespace crane
