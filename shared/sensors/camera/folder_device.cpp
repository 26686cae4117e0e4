// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/folder_device.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <thread>
#include <utility>

namespace crane {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSides[2] = {"left", "right"};
constexpr std::chrono::milliseconds kLookEvery{5};
constexpr TimeNs kHour = 3600 * kNsPerSecond;

bool is_image(const fs::path& file) {
  const std::string name = file.filename().string();
  if (name.empty() || name.front() == '.') return false;  // being written, by rsync's custom
  const std::string extension = file.extension().string();
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

}  // namespace

std::optional<TimeNs> time_of_name(std::string_view stem) {
  TimeNs time = 0;
  if (stem.size() < 16 || stem.size() > 19) return std::nullopt;
  for (const char c : stem)
    if (c < '0' || c > '9') return std::nullopt;
  const auto [end, failed] = std::from_chars(stem.data(), stem.data() + stem.size(), time);
  if (failed != std::errc() || end != stem.data() + stem.size() || time <= 0) return std::nullopt;
  return time;
}

FolderDevice::FolderDevice(FolderOptions options, const Clock& clock, const Clock& steady)
    : options_(std::move(options)), clock_(clock), steady_(steady) {
  // Whether they have colour only an image knows: readers must know us before the first one comes.
  if (options_.rig)
    image_bytes_ = std::size_t{3} * options_.rig->left.width * options_.rig->left.height;
}

Result<void> FolderDevice::open() {
  close();
  return look(true);
}

void FolderDevice::close() {
  for (auto& seen : seen_) seen.clear();
  waiting_.clear();
  remark_.clear();
}

/// Which files came since the last look; what is gone is forgotten.
Result<void> FolderDevice::look(bool first) {
  for (int side = 0; side < 2; ++side) {
    const fs::path folder = fs::path(options_.path) / kSides[side];
    std::error_code failed;
    std::set<std::string> now;
    for (fs::directory_iterator it(folder, failed), end; !failed && it != end;
         it.increment(failed)) {
      if (!is_image(it->path())) continue;
      now.insert(it->path().filename().string());
      if (now.size() > kMostFiles)
        return Error{ErrorCode::kResource, folder.string(),
                     "holds more than " + std::to_string(kMostFiles) + " images",
                     "delete old ones, or set camera.remove: true"};
    }
    if (failed)
      return Error{ErrorCode::kNotAvailable, folder.string(), "cannot be read: " + failed.message(),
                   "camera.path must have the folders left and right, for this user to read"};
    for (const std::string& name : now) {
      if (first || seen_[side].contains(name)) continue;
      const fs::path path = folder / name;
      const std::string stem = path.stem().string();
      if (waiting_.size() >= kMostWaiting && !waiting_.contains(stem)) {
        ++too_many_;
        continue;
      }
      Pair& pair = waiting_[stem];
      if (pair.since == 0) pair.since = steady_.now();
      pair.side[side].path = path.string();
      pair.side[side].grew = steady_.now();
      if (const auto named = time_of_name(stem)) {
        pair.time = *named;
      } else if (struct stat s{}; side == 0 && stat(path.c_str(), &s) == 0) {
        pair.time = s.st_mtim.tv_sec * kNsPerSecond + s.st_mtim.tv_nsec;
      }
    }
    seen_[side] = std::move(now);
  }
  return {};
}

/// One file, as far as it is there. Refused: unreadable, counted.
Result<FolderDevice::State> FolderDevice::decode(File& file, bool left, std::size_t pixels,
                                                 DropCounts& dropped) {
  if (file.image) return State::kComplete;
  const CameraModel* model =
      options_.rig ? (left ? &options_.rig->left : &options_.rig->right) : nullptr;
  struct stat s {};
  if (stat(file.path.c_str(), &s) != 0) {  // deleted before it was read
    dropped.add(Cause::kImageUnreadable);
    remark_ = file.path +
              ": was gone before it was read -> who tidies this folder? Leave files there for 2 s";
    return State::kRefused;
  }
  const auto size = static_cast<std::uint64_t>(s.st_size);
  if (size != file.tried_size) {
    file.tried_size = size;
    file.grew = steady_.now();
    auto image = read_image(file.path, pixels, model != nullptr ? model->bits : 0);
    if (image && model != nullptr &&
        (image->width != model->width || image->height != model->height)) {
      dropped.add(Cause::kImageUnreadable);
      remark_ = file.path + ": " + std::to_string(image->width) + " x " +
                std::to_string(image->height) + " pixels, the calibration is of " +
                std::to_string(model->width) + " x " + std::to_string(model->height) +
                " -> use the calibration of this camera at this resolution";
      return State::kRefused;
    }
    if (image) {
      file.image = std::move(*image);
      return State::kComplete;
    }
    if (image.error().code == ErrorCode::kConfiguration) return image.error();
  }
  if (steady_.now() - file.grew < kPatience) return State::kWaiting;
  auto image = read_image(file.path, pixels, model != nullptr ? model->bits : 0);
  if (image) {  // was written over without growing
    file.tried_size = 0;
    return State::kWaiting;
  }
  dropped.add(Cause::kImageUnreadable);
  remark_ = image.error().text();
  return State::kRefused;
}

Result<FolderDevice::State> FolderDevice::judge(Pair& pair, const FrameBuffers& out,
                                                DropCounts& dropped) {
  // Not before both are there: images that wait alone would fill the memory.
  const bool single = pair.side[0].path.empty() || pair.side[1].path.empty();
  bool complete = !single;
  for (int side = 0; side < 2 && !single; ++side) {
    const auto state = decode(pair.side[side], side == 0, out.pixels, dropped);
    if (!state || *state == State::kRefused) return state;
    complete = complete && *state == State::kComplete;
  }
  if (complete) {
    const Image& left = *pair.side[0].image;
    const Image& right = *pair.side[1].image;
    if (left.channels != right.channels) {
      dropped.add(Cause::kColourDiffers);
      remark_ = pair.side[0].path + ": left and right differ in colour";
      return State::kRefused;
    }
    if (left.width != right.width || left.height != right.height) {
      dropped.add(Cause::kImageUnreadable);
      remark_ = pair.side[0].path + ": left and right differ in size";
      return State::kRefused;
    }
    return State::kComplete;
  }
  if (single && steady_.now() - pair.since >= kPatience) {
    dropped.add(Cause::kPairIncomplete);
    remark_ =
        (pair.side[0].path.empty() ? pair.side[1].path : pair.side[0].path) +
        ": its other image did not come within a second -> both files of a pair have one name";
    return State::kRefused;
  }
  return State::kWaiting;
}

void FolderDevice::forget(std::map<std::string, Pair>::iterator pair) {
  if (options_.remove)
    for (const File& file : pair->second.side)
      if (std::error_code ignored; !file.path.empty()) fs::remove(file.path, ignored);
  waiting_.erase(pair);
}

Result<bool> FolderDevice::grab(const FrameBuffers& out, FrameFacts& facts,
                                FrameSource::Deadline deadline, DropCounts& dropped) {
  for (;;) {
    if (auto looked = look(false); !looked) return looked.error();
    if (const std::uint64_t lost = std::exchange(too_many_, 0); lost > 0)
      dropped.add(Cause::kFrameOvertaken, lost);
    // Newest first: what is older than the pair that is taken is not even decoded.
    std::vector<std::pair<TimeNs, std::string>> order;
    for (const auto& [stem, pair] : waiting_) order.emplace_back(pair.time, stem);
    std::sort(order.rbegin(), order.rend());
    for (const auto& [time, stem] : order) {
      const auto it = waiting_.find(stem);
      const Stopwatch watch;
      auto state = judge(it->second, out, dropped);
      if (!state) return state.error();
      if (*state == State::kRefused) forget(it);
      if (*state != State::kComplete) continue;
      const Image& left = *it->second.side[0].image;
      const Image& right = *it->second.side[1].image;
      image_bytes_ = std::max(image_bytes_, left.bytes.size());
      if (left.bytes.size() > out.bytes) return false;  // it waits for larger buffers
      facts.decode_ms = watch.ms();
      const Stopwatch fill;
      facts.width = left.width;
      facts.height = left.height;
      facts.format = format_of_channels(left.channels);
      facts.exposure_time = time - options_.latency;
      std::memcpy(out.left, left.bytes.data(), left.bytes.size());
      std::memcpy(out.right, right.bytes.data(), right.bytes.size());
      facts.fill_ms = fill.ms();
      remark_.clear();
      if (!time_of_name(stem))
        remark_ = options_.path +
                  ": names are no times, when files were written stands for it -> " +
                  "name them by the exposure's nanoseconds since 1970, or tell camera.latency_ms";
      else if (std::abs(clock_.now() - time) > kHour)
        remark_ = options_.path + ": file names are hours from this host's clock -> " +
                  "rangefinders and camera need one clock";
      forget(it);
      for (auto old = waiting_.begin(); old != waiting_.end();) {
        const auto following = std::next(old);
        const bool whole = !old->second.side[0].path.empty() && !old->second.side[1].path.empty();
        if (old->second.time < time && whole) {
          dropped.add(Cause::kFrameOvertaken);
          forget(old);
        }
        old = following;
      }
      return true;
    }
    if (std::chrono::steady_clock::now() + kLookEvery >= deadline) return false;
    std::this_thread::sleep_for(kLookEvery);
  }
}

}  // namespace crane
