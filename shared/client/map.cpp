// SPDX-License-Identifier: Apache-2.0
#include "crane/client/map.hpp"

#include "client/map_impl.hpp"
#include "client/map_status.hpp"
#include "dds/participant.hpp"

namespace crane::client {
namespace {

using namespace std::chrono_literals;

/// A map, or the reason why not.
template <class Join>
std::unique_ptr<Map> joined(std::string& error, const Join& join) noexcept {
  try {
    return join();
  } catch (const std::exception& e) {
    error = answer_or(std::string(kOutOfMemory), [&] { return std::string(e.what()); });
  } catch (...) {
    error = "unknown";
  }
  return nullptr;
}

}  // namespace

Map::Impl::~Impl() {
  stop = true;
  wakeup.notify();
  if (thread.joinable()) thread.join();
}

void Map::Impl::run() {
  name_thread("map follower");
  while (!stop) {
    turning.turned();
    try {
      wakeup.wait_for(100ms);
      tell(follower->step());
    } catch (...) {
      // Out of memory, or thrown by the callback: the map itself is whole.
      calling = std::thread::id();
    }
  }
}

void Map::Impl::tell(const std::vector<TileKey>& changed) {
  if (changed.empty()) return;
  Update update;
  {
    const std::shared_lock lock(follower->mutex);
    const Status s = status_of(*follower);
    update = {s.map_id, s.revision, s.valid, s.complete, {}};
    const double edge = follower->voxel_m() * kTileEdge;
    for (const TileKey key : changed)
      update.areas.push_back({key.x * edge, key.y * edge, (key.x + 1) * edge, (key.y + 1) * edge});
  }
  const std::lock_guard lock(callback_mutex);
  calling = std::this_thread::get_id();
  if (const auto running = callback; running != nullptr) (*running)(update);
  calling = std::thread::id();
}

Map::Map(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Map::~Map() = default;

std::unique_ptr<Map> Map::join(const Options& options, std::string& error) noexcept {
  return joined(error, [&] {
    dds::Settings settings;
    static_cast<NetworkSettings&>(settings) = options;
    settings.guest = true;
    settings.crane = options.crane;
    if (settings.identity.empty()) settings.identity = "controller";
    return Impl::follow(dds::Participant::create(settings, "cranemap-client"), options, error);
  });
}

std::unique_ptr<Map> Map::join(eprosima::fastdds::dds::DomainParticipant& participant,
                               const MapOptions& options, std::string& error) noexcept {
  return joined(error, [&] {
    return Impl::follow(dds::Participant::within(participant, options.crane), options, error);
  });
}

std::unique_ptr<Map> Map::Impl::follow(const Result<std::shared_ptr<dds::Participant>>& participant,
                                       const MapOptions& options, std::string& error) {
  if (!participant) {
    error = participant.error().text();
    return nullptr;
  }
  auto impl = std::make_unique<Impl>();
  auto follower =
      MapFollower::create(*participant, &impl->wakeup, std::size_t(options.max_memory_mib) << 20U);
  if (!follower) {
    error = follower.error().text();
    return nullptr;
  }
  impl->follower = std::move(*follower);
  impl->thread = std::thread([raw = impl.get()] { raw->run(); });
  return std::unique_ptr<Map>(new Map(std::move(impl)));
}

bool Map::on_update(std::function<void(const Update&)> callback) noexcept {
  return answer_or(false, [&] {
    std::shared_ptr<const std::function<void(const Update&)>> next;
    if (callback)
      next = std::make_shared<const std::function<void(const Update&)>>(std::move(callback));
    if (impl_->calling == std::this_thread::get_id()) {  // which holds the mutex
      impl_->callback = std::move(next);
      return true;
    }
    const std::lock_guard lock(impl_->callback_mutex);
    impl_->callback = std::move(next);
    return true;
  });
}

}  // namespace crane::client
