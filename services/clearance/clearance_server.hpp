// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/drop_counts.hpp"
#include "base/stage_times.hpp"
#include "base/wakeup.hpp"
#include "crane/client/map.hpp"
#include "dds/endpoints.hpp"
#include "service/fair_queue.hpp"

namespace crane {

client::ClearanceQuery to_query(const v1::ClearanceRequest& request);
v1::ClearanceReply to_reply(const v1::ClearanceRequest& request, const client::Clearance& answer);

/// Answers clearance_request from a map that it follows as any client does. One thread.
class ClearanceServer {
 public:
  /// Error: what DDS says.
  static Result<ClearanceServer> create(const std::shared_ptr<dds::Participant>& participant,
                                        std::unique_ptr<client::Map> map);

  /// Answers what has come, waiting for it up to `limit`; of a flood a few only, so that the
  /// caller's heartbeat has its time, and of each client in turn. Error: a reply that DDS refuses.
  Result<void> step(std::chrono::milliseconds limit);

  [[nodiscard]] const client::Map& map() const { return *map_; }
  [[nodiscard]] std::uint64_t answered() const { return answered_; }
  [[nodiscard]] dds::ReaderCounts counts() const { return requests_.counts(); }
  StageTimes stages;
  DropCounts dropped;

 private:
  ClearanceServer(std::unique_ptr<Wakeup> wakeup, dds::Reader<dds::ClearanceRequestTopic> requests,
                  dds::Writer<dds::ClearanceReplyTopic> replies, std::unique_ptr<client::Map> map)
      : wakeup_(std::move(wakeup)),
        requests_(std::move(requests)),
        replies_(std::move(replies)),
        map_(std::move(map)) {}

  std::unique_ptr<Wakeup> wakeup_;  ///< the reader's callbacks know its address
  dds::Reader<dds::ClearanceRequestTopic> requests_;
  dds::Writer<dds::ClearanceReplyTopic> replies_;
  std::unique_ptr<client::Map> map_;
  std::uint64_t answered_ = 0;
  struct Waiting {
    v1::ClearanceRequest request;
    TimeNs sent = 0;
  };
  FairQueue<dds::ParticipantId, Waiting> waiting_{64, 32};
};

}  // namespace crane
