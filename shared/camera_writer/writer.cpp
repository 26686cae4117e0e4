// SPDX-License-Identifier: Apache-2.0
#include "crane/camera/writer.hpp"

#include <algorithm>
#include <optional>
#include <random>
#include <utility>

#include "base/clock.hpp"
#include "dds/endpoints.hpp"
#include "imaging/pixel_format.hpp"

namespace crane::camera {
namespace {

constexpr const char* kOutOfMemory = "out of memory";  // so short that a string of it takes none

dds::Settings settings_of(const Options& o) {
  dds::Settings s;
  static_cast<NetworkSettings&>(s) = o;
  s.guest = true;
  s.crane = o.crane;
  if (s.identity.empty()) s.identity = "camera";
  return s;
}

/// Bytes of an image; nothing, and why, where it can be none.
std::optional<std::size_t> capacity_of(const Options& o, std::string& error) {
  const auto format = pixel_format(static_cast<std::uint32_t>(o.encoding));
  if (!format) {
    error = "Options::encoding " + std::to_string(static_cast<std::uint32_t>(o.encoding)) +
            " is unknown -> use one of Encoding";
    return std::nullopt;
  }
  const std::size_t pixels = std::size_t{o.width} * o.height;
  const std::size_t jpeg = o.jpeg_bytes > 0 ? o.jpeg_bytes : pixels;
  const std::size_t bytes = image_bytes(*format, o.width, o.height).value_or(jpeg);
  if (const char* flaw = image_flaw(*format, o.width, o.height, bytes)) {
    error = std::to_string(o.width) + " x " + std::to_string(o.height) + " " + name_of(*format) +
            ": " + flaw + " -> at most 2448 x 2048 pixels; widths of yuyv and 12p are even, of " +
            "10p multiples of 4";
    return std::nullopt;
  }
  return bytes;
}

std::uint64_t random_stream() {
  std::random_device random;
  return (std::uint64_t{random()} << 32U) | random() | 1U;
}

}  // namespace

struct Writer::Impl {
  Options options;
  std::shared_ptr<dds::Participant> participant;
  dds::Writer<dds::StereoFrameTopic> writer;
  std::size_t capacity = 0;
  std::uint64_t stream = random_stream(), sequence = 0;
  std::int64_t last_time = 0;
  dds::StereoFrame* lent = nullptr;

  ~Impl() {
    if (lent != nullptr) writer.discard(lent);
  }

  bool publish(std::int64_t time, std::size_t left, std::size_t right, std::string& error) {
    const auto refuse = [&](const char* why) {
      error = why;
      return false;
    };
    if (lent == nullptr) return refuse("publish() without a pair that was lent -> loan() first");
    if (time <= last_time)
      return refuse(last_time == 0 ? "the exposure time is not after 1970 -> nanoseconds since the "
                                     "Unix epoch"
                                   : "exposed no later than the pair before -> a clock that was "
                                     "set back: open a new Writer");
    if (std::max(left, right) > capacity)
      return refuse("more bytes than were lent -> set Options::jpeg_bytes");
    if (std::min(left, right) == 0) return refuse("an image without a byte");
    dds::StereoFrame* frame = std::exchange(lent, nullptr);
    frame->crane(options.crane);
    frame->encoding(static_cast<std::uint32_t>(options.encoding));
    frame->stream(stream);
    frame->sequence_number(sequence++);
    frame->after(-1);
    frame->exposure_time_ns(time);
    frame->calibration(0);
    frame->width(options.width);
    frame->height(options.height);
    frame->left().shrink(left);
    frame->right().shrink(right);
    last_time = time;
    if (auto sent = writer.publish(frame); !sent) {
      error = sent.error().text();
      return false;
    }
    return true;
  }
};

Writer::Writer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Writer::~Writer() = default;

std::unique_ptr<Writer> Writer::open(const Options& options, std::string& error) noexcept {
  try {
    const auto capacity = capacity_of(options, error);
    if (!capacity) return nullptr;
    auto participant = dds::Participant::create(settings_of(options), "cranemap-camera-writer");
    if (!participant) {
      error = participant.error().text();
      return nullptr;
    }
    auto writer = dds::Writer<dds::StereoFrameTopic>::create(
        *participant, dds::StereoFrameTopic::kName, 0, *capacity);
    if (!writer) {
      error = writer.error().text();
      return nullptr;
    }
    return std::unique_ptr<Writer>(new Writer(std::unique_ptr<Impl>(
        new Impl{options, std::move(*participant), std::move(*writer), *capacity})));
  } catch (...) {
    error = kOutOfMemory;
  }
  return nullptr;
}

Pair Writer::loan() noexcept {
  try {
    if (impl_->lent == nullptr) impl_->lent = impl_->writer.loan();
    if (impl_->lent == nullptr) return {};
    return {impl_->lent->left().data(), impl_->lent->right().data(), impl_->capacity};
  } catch (...) {
    return {};
  }
}

bool Writer::publish(std::int64_t exposure_time_ns, std::string& error) noexcept {
  if (impl_->options.encoding == Encoding::kJpeg) {
    error = "of JPEG the bytes of each image must be said";
    return false;
  }
  return publish(exposure_time_ns, impl_->capacity, impl_->capacity, error);
}

bool Writer::publish(std::int64_t exposure_time_ns, std::size_t left_bytes, std::size_t right_bytes,
                     std::string& error) noexcept {
  try {
    if (impl_->options.encoding != Encoding::kJpeg) left_bytes = right_bytes = impl_->capacity;
    return impl_->publish(exposure_time_ns, left_bytes, right_bytes, error);
  } catch (...) {
    error = kOutOfMemory;
    return false;
  }
}

void Writer::missed(std::uint64_t frames) noexcept {
  impl_->sequence += frames;
}

int Writer::readers() const noexcept {
  return impl_->writer.matched();
}

}  // namespace crane::camera
