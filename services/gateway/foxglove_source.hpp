// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "crane/client/map.hpp"
#include "dds/endpoints.hpp"
#include "gateway/foxglove_channels.hpp"
#include "gateway/map_files.hpp"

namespace crane::gateway {

/// Makes what is large for viewers, while they want it, in a thread of its own: at most 4 clouds, 2
/// images, 1 grid a second and voxels every 3 s. Clouds and frames are read from DDS only as long
/// as somebody wants them; what breaks its contract is left out, the services that use it count it.
class FoxgloveSource {
 public:
  /// `said`: called when a channel said something new. All but `said` outlive this.
  FoxgloveSource(std::shared_ptr<dds::Participant> participant, const client::Map& map,
                 MapFiles& files, FoxgloveChannels& channels, std::function<void()> said);
  ~FoxgloveSource();
  FoxgloveSource(const FoxgloveSource&) = delete;
  FoxgloveSource& operator=(const FoxgloveSource&) = delete;

 private:
  struct Work;
  std::atomic<bool> stopping_{false};
  std::unique_ptr<Work> work_;
  std::thread thread_;
};

}  // namespace crane::gateway
