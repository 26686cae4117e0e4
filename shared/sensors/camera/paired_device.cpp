// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/paired_device.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace crane {
namespace {

using namespace std::chrono_literals;

constexpr const char* kSide[] = {"left camera: ", "right camera: "};
/// A thread looks so often whether it is to end.
constexpr auto kTurn = 50ms;
/// Images without a pair, until it is said.
constexpr std::uint64_t kAlone = 8;

}  // namespace

PairedDevice::PairedDevice(std::unique_ptr<StereoDevice> left, std::unique_ptr<StereoDevice> right,
                           PairRule rule, std::size_t bytes, std::size_t pixels)
    : rule_(rule), bytes_(bytes), pixels_(pixels) {
  sides_[0].device = std::move(left);
  sides_[1].device = std::move(right);
}

PairedDevice::~PairedDevice() {
  PairedDevice::close();
  for (Side& side : sides_)
    if (side.thread.joinable()) side.thread.join();
}

Result<void> PairedDevice::open() {
  if (!let_go())
    return last_.value_or(
        Error{ErrorCode::kNotAvailable, "camera", "is still being let go", "wait a moment"});
  for (Side& side : sides_) {
    auto opened = side.device->open();
    if (opened) continue;
    for (Side& each : sides_) each.device->close();
    return opened;
  }
  matcher_.emplace(rule_);
  for (const int side : {0, 1})
    sides_[side].thread = std::thread(&PairedDevice::follow, this, side);
  return {};
}

/// Tells the threads to end, and does not wait: a camera that is gone lets none of those who ask it
/// go for seconds.
void PairedDevice::close() {
  const std::lock_guard lock(mutex_);
  stop_ = true;
  remark_.clear();
  missed_ = 0;
}

/// Whether nothing of the last connection goes on any more.
bool PairedDevice::let_go() {
  {
    const std::lock_guard lock(mutex_);
    for (const Side& side : sides_)
      if (side.thread.joinable() && !side.ended) return false;
  }
  for (Side& side : sides_) {
    if (side.thread.joinable()) side.thread.join();
    side.ended = false;
    side.images = side.missed = 0;
    side.remark.clear();
    side.about.clear();
  }
  stop_ = false;
  lost_.reset();
  matcher_.reset();
  return true;
}

/// A side's thread.
void PairedDevice::follow(int side) {
  Side& mine = sides_[side];
  HalfFrame half;
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (stop_) break;
      if (half.image.empty()) half = matcher_->spare();
    }
    half.image.resize(bytes_);
    DropCounts dropped;
    const auto got = mine.device->grab({half.image.data(), nullptr, bytes_, pixels_}, half.facts,
                                       std::chrono::steady_clock::now() + kTurn, dropped);
    const std::lock_guard lock(mutex_);
    dropped.for_each([this](Cause cause, std::uint64_t count) { pending_.add(cause, count); });
    mine.remark = mine.device->remark();
    mine.about = mine.device->about();
    if (!got) {
      if (!lost_) lost_ = got.error();
    } else if (*got) {
      ++mine.images;
      mine.missed += mine.device->missed();
      matcher_->add(side, std::exchange(half, {}), pending_);
    }
    came_.notify_one();
    if (!got) break;
  }
  mine.device->close();
  const std::lock_guard lock(mutex_);
  mine.ended = true;
}

Result<bool> PairedDevice::hand_over(const PairMatcher::Pair& pair, const FrameBuffers& out,
                                     FrameFacts& facts, DropCounts& dropped) {
  const FrameFacts& l = pair.left.facts;
  const FrameFacts& r = pair.right.facts;
  const std::size_t size = crane::image_bytes(l.format, l.width, l.height).value_or(0);
  if (l.width != r.width || l.height != r.height || l.format != r.format || size == 0 ||
      size > out.bytes) {
    dropped.add(l.format != r.format ? Cause::kColourDiffers : Cause::kImageUnreadable);
    remark_ = "the cameras' images differ in size or colour -> set both to one mode";
    return false;
  }
  const Stopwatch watch;
  std::memcpy(out.left, pair.left.image.data(), size);
  std::memcpy(out.right, pair.right.image.data(), size);
  facts.width = l.width;
  facts.height = l.height;
  facts.format = l.format;
  facts.exposure_time = l.exposure_time + (r.exposure_time - l.exposure_time) / 2;
  facts.number = l.number;
  facts.decode_ms = l.decode_ms + r.decode_ms;
  facts.late_ms = std::max(l.late_ms, r.late_ms);
  facts.fill_ms = watch.ms();
  return true;
}

Result<bool> PairedDevice::grab(const FrameBuffers& out, FrameFacts& facts,
                                FrameSource::Deadline deadline, DropCounts& dropped) {
  std::unique_lock lock(mutex_);
  if (!matcher_ || stop_) return Error{ErrorCode::kNotAvailable, "camera", "is not connected", ""};
  std::optional<PairMatcher::Pair> pair;
  came_.wait_until(lock, deadline, [&] { return lost_ || (pair = matcher_->take()); });
  pending_.for_each([&](Cause cause, std::uint64_t count) { dropped.add(cause, count); });
  pending_ = {};
  remark_.clear();
  if (lost_) {
    last_ = lost_;
    return *lost_;
  }
  if (!pair) {
    const std::uint64_t left = sides_[0].images;
    const std::uint64_t right = sides_[1].images;
    if (std::max(left, right) > kAlone && std::min(left, right) == 0)
      remark_ = std::string("only the ") + (left > 0 ? "left" : "right") +
                " camera gives images -> is the other one on, and triggered?";
    else if (std::min(left, right) > kAlone)
      remark_ =
          "images of the two cameras are not of one moment -> one trigger for both, or PTP; "
          "camera.pair_within_ms";
    return false;
  }
  sides_[0].images = sides_[1].images = 0;
  missed_ = std::max(std::exchange(sides_[0].missed, 0), std::exchange(sides_[1].missed, 0));
  // Copied without the lock: the threads go on.
  lock.unlock();
  auto done = hand_over(*pair, out, facts, dropped);
  lock.lock();
  matcher_->give_back(std::move(pair->left));
  matcher_->give_back(std::move(pair->right));
  return done;
}

std::string PairedDevice::remark() const {
  const std::lock_guard lock(mutex_);
  if (!remark_.empty()) return remark_;
  for (const int side : {0, 1})
    if (!sides_[side].remark.empty()) return kSide[side] + sides_[side].remark;
  return {};
}

std::string PairedDevice::about() const {
  const std::lock_guard lock(mutex_);
  return kSide[0] + sides_[0].about + "; " + kSide[1] + sides_[1].about;
}

}  // namespace crane
