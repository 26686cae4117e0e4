// SPDX-License-Identifier: Apache-2.0
#include "clearance/clearance_server.hpp"

#include <cmath>

#include "bounds.h"

namespace crane {
namespace {

// The client's enumerations and the numbers on the network are the same.
static_assert(int(client::Verdict::kInvalid) == v1::VERDICT_INVALID &&
              int(client::Verdict::kClear) == v1::VERDICT_CLEAR &&
              int(client::Verdict::kBlocked) == v1::VERDICT_BLOCKED);
static_assert(int(client::Reason::kNone) == v1::CLEARANCE_NONE &&
              int(client::Reason::kMapInvalid) == v1::CLEARANCE_MAP_INVALID &&
              int(client::Reason::kBadQuery) == v1::CLEARANCE_BAD_QUERY &&
              int(client::Reason::kObstacle) == v1::CLEARANCE_OBSTACLE &&
              int(client::Reason::kUnknown) == v1::CLEARANCE_UNKNOWN &&
              int(client::Reason::kStale) == v1::CLEARANCE_STALE &&
              int(client::Reason::kZone) == v1::CLEARANCE_ZONE &&
              int(client::Reason::kFewViews) == v1::CLEARANCE_FEW_VIEWS);

/// So many requests, each of some tens of milliseconds at most, may keep whoever steps the server
/// from its heartbeat.
constexpr int kMostAStep = 4;
/// So many are looked at: a client that floods is to find others' requests still in the history of
/// the reader, which has 64 of a crane.
constexpr int kMostTaken = 256;

}  // namespace

client::ClearanceQuery to_query(const v1::ClearanceRequest& r) {
  client::ClearanceQuery q;
  for (const v1::ClearancePose& p : r.path())
    q.path.push_back({p.x_m(), p.y_m(), p.z_m(), p.yaw_rad()});
  q.load = {r.load_size_x_m(), r.load_size_y_m(), r.load_size_z_m(), r.load_above_m()};
  q.margins = {r.margin_horizontal_m(), r.margin_vertical_m(), r.sway_m(), r.braking_m()};
  q.max_age_s = r.max_age_s();
  q.min_views = r.min_views();
  return q;
}

v1::ClearanceReply to_reply(const v1::ClearanceRequest& request, const client::Clearance& a) {
  v1::ClearanceReply reply;
  reply.crane(request.crane());
  reply.client(request.client());
  reply.sequence_number(request.sequence_number());
  reply.time_ns(SystemClock().now());
  reply.verdict(static_cast<std::uint32_t>(a.verdict));
  reply.reason(static_cast<std::uint32_t>(a.reason));
  reply.map_id(a.map_id);
  reply.revision(a.revision);
  reply.slow_down(a.slow_down ? 1 : 0);
  reply.zone(a.zone);
  const bool has_height = a.verdict != client::Verdict::kInvalid && std::isfinite(a.safe_height_m);
  reply.has_safe_height(has_height ? 1 : 0);
  reply.safe_height_m(has_height ? a.safe_height_m : 0);
  reply.safe_low_m(has_height ? a.safe_low_m : 0);
  reply.safe_high_m(has_height ? a.safe_high_m : 0);
  reply.first_x_m(a.first_x_m);
  reply.first_y_m(a.first_y_m);
  reply.first_z_m(a.first_z_m);
  reply.oldest_age_s(a.oldest_age_s);
  reply.unknown_fraction(a.unknown_fraction);
  reply.text(a.text.substr(0, 255).c_str());
  return reply;
}

Result<ClearanceServer> ClearanceServer::create(
    const std::shared_ptr<dds::Participant>& participant, std::unique_ptr<client::Map> map) {
  auto wakeup = std::make_unique<Wakeup>();
  auto requests = dds::Reader<dds::ClearanceRequestTopic>::create(participant, wakeup.get());
  if (!requests) return requests.error();
  auto replies = dds::Writer<dds::ClearanceReplyTopic>::create(participant);
  if (!replies) return replies.error();
  return ClearanceServer(std::move(wakeup), std::move(*requests), std::move(*replies),
                         std::move(map));
}

Result<void> ClearanceServer::step(std::chrono::milliseconds limit) {
  wakeup_->wait_for(limit);
  int taken = 0;
  for (; taken < kMostTaken; ++taken) {
    const auto request = requests_.take();
    if (request == nullptr) break;
    if (!waiting_.push(request->writer(), {**request, request->source_time_ns()}))
      dropped.add(Cause::kTooManyRequests);
  }
  for (int n = 0; n < kMostAStep; ++n) {
    const auto next = waiting_.pop();
    if (!next) break;
    const v1::ClearanceRequest& request = next->request;
    const Stopwatch watch;
    const client::Clearance answer = map_->clearance(to_query(request));
    stages.add("clearance", watch.ms());
    if (answer.verdict == client::Verdict::kInvalid)
      dropped.add(answer.reason == client::Reason::kBadQuery ? Cause::kNoAnswerBadQuery
                                                             : Cause::kNoAnswerMapInvalid);
    if (auto sent = replies_.write(to_reply(request, answer)); !sent) return sent;
    stages.add("request to reply", double(SystemClock().now() - next->sent) * 1e-6);
    ++answered_;
  }
  // There may be more: the next step is not to wait for them.
  if (!waiting_.empty() || taken == kMostTaken) wakeup_->notify();
  return {};
}

}  // namespace crane
