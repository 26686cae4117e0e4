// SPDX-License-Identifier: Apache-2.0
#include "gateway/foxglove_source.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "base/log.hpp"
#include "base/loop_watch.hpp"
#include "base/wakeup.hpp"
#include "gateway/foxglove_messages.hpp"
#include "service/every.hpp"

namespace crane::gateway {
namespace {

using namespace std::chrono_literals;

// What a viewer is sent at a time stays below some 3 MB.
constexpr std::size_t kMostPoints = 100'000, kMostCells = 300'000, kMostVoxels = 2'000'000;
constexpr int kMostImagePx = 640;

/// A reader that is there while it is wanted.
template <class Topic>
class Wanted {
 public:
  /// The newest sample that came since; nothing: none, or it is not wanted.
  std::unique_ptr<dds::Received<typename Topic::Type>> take(
      bool wanted, const std::shared_ptr<dds::Participant>& participant, Wakeup& wakeup) {
    if (!wanted) {
      reader_.reset();
      said_ = false;
      return nullptr;
    }
    if (!reader_) {
      auto made = dds::Reader<Topic>::create(participant, &wakeup);
      if (!made) {
        if (!std::exchange(said_, true)) log_warning(made.error().text());
        return nullptr;
      }
      reader_.emplace(std::move(*made));
    }
    std::unique_ptr<dds::Received<typename Topic::Type>> newest;
    while (auto sample = reader_->take()) newest = std::move(sample);
    return newest;
  }

 private:
  std::optional<dds::Reader<Topic>> reader_;
  bool said_ = false;
};

}  // namespace

struct FoxgloveSource::Work {
  std::shared_ptr<dds::Participant> participant;
  const client::Map& map;
  MapFiles& files;
  FoxgloveChannels& channels;
  std::function<void()> said;

  Wakeup wakeup{};
  Wanted<dds::PartialCloudTopic> clouds{};
  Wanted<dds::StereoFrameTopic> frames{};
  Every cloud_due{4}, image_due{2}, grid_due{1}, voxels_due{1.0 / 3};
  std::pair<std::uint64_t, std::uint64_t> grid_of{}, voxels_of{};

  void put(Channel channel, std::string payload) const {
    channels.put(channel, SystemClock().now(), std::move(payload));
    said();
  }

  void turn() {
    if (const auto cloud = clouds.take(channels.wanted(Channel::kCloud), participant, wakeup))
      if (cloud_due.due()) {
        std::string made = foxglove::point_cloud(**cloud, kMostPoints);
        if (cloud->intact()) put(Channel::kCloud, std::move(made));
      }
    if (const auto frame = frames.take(channels.wanted(Channel::kImage), participant, wakeup))
      if (image_due.due()) {
        auto made = foxglove::left_image(**frame, kMostImagePx);
        if (made && frame->intact()) put(Channel::kImage, std::move(*made));
      }
    const client::Status s = map.status();
    const std::pair now{s.map_id, s.revision};
    if (changed(Channel::kHeights, grid_of, now) && grid_due.due()) {
      const client::HeightGrid heights = map.heights();
      if (!heights.cells.empty())
        put(Channel::kHeights, foxglove::grid(heights, s.last_frame_time_ns, kMostCells));
      grid_of = now;
    }
    if (changed(Channel::kVoxels, voxels_of, now) && voxels_due.due() && put_voxels(s))
      voxels_of = now;
  }

  /// Of a channel that nobody wants nothing is kept: whoever comes wants it anew.
  bool changed(Channel channel, std::pair<std::uint64_t, std::uint64_t>& of,
               const std::pair<std::uint64_t, std::uint64_t>& now) const {
    if (!channels.wanted(channel)) of = {};
    return channels.wanted(channel) && of != now && now.first != 0;
  }

  bool put_voxels(const client::Status& s) const {
    const auto bt = files.get("bt");
    if (!bt) return false;  // another one is being made: next time
    const auto octomap = decode_octomap({bt->begin(), bt->end()}, "map.bt");
    if (!octomap) {
      log_warning(octomap.error().text());
      return true;
    }
    auto made = foxglove::voxel_grid(*octomap, s.last_frame_time_ns, kMostVoxels);
    if (made) put(Channel::kVoxels, std::move(*made));
    return true;
  }
};

FoxgloveSource::FoxgloveSource(std::shared_ptr<dds::Participant> participant,
                               const client::Map& map, MapFiles& files, FoxgloveChannels& channels,
                               std::function<void()> said)
    : work_(new Work{std::move(participant), map, files, channels, std::move(said)}),
      thread_([this] {
        name_thread("foxglove");
        while (!stopping_) {
          work_->wakeup.wait_for(100ms);
          try {
            work_->turn();
          } catch (const std::exception& e) {  // out of memory: this one is left out
            log_warning(std::string("a message for viewers could not be made: ") + e.what());
          }
        }
      }) {}

FoxgloveSource::~FoxgloveSource() {
  stopping_ = true;
  work_->wakeup.notify();
  thread_.join();
}

}  // namespace crane::gateway
