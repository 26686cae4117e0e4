// SPDX-License-Identifier: Apache-2.0
#include "gateway/watcher.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <set>

#include "base/log.hpp"
#include "gateway/api.hpp"
#include "gateway/foxglove_feed.hpp"
#include "gateway/foxglove_source.hpp"
#include "gateway/foxglove_states.hpp"
#include "gateway/json.hpp"
#include "gateway/site_files.hpp"
#include "gateway/token.hpp"
#include "geometry/footprint.hpp"
#include "http/server.hpp"
#include "mapping_pipeline/gantry.hpp"
#include "recording/calibration.hpp"
#include "service/client_options.hpp"
#include "service/every.hpp"

namespace crane::gateway {
namespace {

using namespace std::chrono_literals;

constexpr double kStateHz = 5;
/// What was said longer ago says nothing of now.
constexpr TimeNs kPositionLives = kNsPerSecond, kHoistLives = kNsPerSecond;

/// Nothing comes from elsewhere, nothing is embedded elsewhere.
const std::vector<std::pair<std::string, std::string>> kPageHeaders = {
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src "
     "'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Cross-Origin-Resource-Policy", "same-origin"}};

/// Which tiles changed since they were last encoded. The map's thread writes, the service's takes.
class Changed {
 public:
  void add(const client::Update& update, double tile_m) {
    if (!(tile_m > 0)) return;
    const std::lock_guard lock(mutex_);
    for (const client::Area& a : update.areas)
      tiles_.insert({int(std::lround(a.x0_m / tile_m)), int(std::lround(a.y0_m / tile_m))});
  }
  std::set<TileAt> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(tiles_, {});
  }

 private:
  std::mutex mutex_;
  std::set<TileAt> tiles_;
};

/// Everything that the gateway reads. One thread.
class Watcher {
 public:
  Watcher(ServiceContext& context, std::optional<StereoRig> rig, std::unique_ptr<client::Map> map)
      : context_(context),
        rig_(std::move(rig)),
        gantry_(context.config.mapper),
        map_(std::move(map)),
        api_(*map_, board_, tiles_),
        viewers_told_(viewers_, context.config.hoist) {}

  Result<void> start(const std::string& page_folder) {
    const auto read = [&]<class Topic>(std::optional<dds::Reader<Topic>>& into) -> Result<void> {
      auto made = dds::Reader<Topic>::create(context_.participant, &wakeup_);
      if (!made) return made.error();
      into.emplace(std::move(*made));
      return {};
    };
    for (const Result<void>& made : {read(positions_in_), read(hoist_in_), read(statuses_in_)})
      if (!made) return made;
    map_->on_update([this](const client::Update& update) {
      changed_.add(update, map_->status().voxel_m * kTileEdge);
      wakeup_.notify();
    });
    if (auto listening = listen(page_folder); !listening) return listening;
    for_viewers_.emplace(context_.participant, *map_, api_.files(), viewers_,
                         [this] { server_->wake(); });
    return {};
  }

  Result<void> run() {
    Every state_due(kStateHz);
    while (!context_.stopping()) {
      wakeup_.wait_for(50ms);
      take_positions();
      take_hoist();
      take_statuses();
      const bool tiles = encode_tiles();
      // What makes an answer invalid is said at once.
      const client::Status s = map_->status();
      const std::tuple now{s.valid, s.reason_code, s.map_id};
      const bool news = now != said_;
      if (state_due.due() || news) {
        board_.put(text_of(state(s)));
        said_ = now;
      }
      tell_viewers(s);
      if (tiles || news || board_.now().number != woken_) server_->wake();
      woken_ = board_.now().number;
      tell(s);
    }
    map_->on_update(nullptr);
    return {};
  }

 private:
  Result<void> listen(const std::string& page_folder) {
    const GatewayConfig& c = context_.config.gateway;
    http::Router router({}, context_.config.http.hosts);
    auto page = read_site_files(page_folder);
    if (page) {
      for (auto& [path, response] : *page)
        router.get(path, [answer = std::move(response)](const auto&) { return answer; });
    } else {
      log_warning(page.error().text() + "; going on with the API alone");
      router.get("/", [](const auto&) {
        return http::Response{200, "The page was not built; the API is at /api/v1/status\n"};
      });
    }
    api_.add_routes(router);
    router.stream(
        "/",
        [this](const auto&) {
          return std::make_unique<FoxgloveFeed>(
              viewers_, "cranemap, crane " + std::to_string(context_.config.crane),
              [] { return MonotonicClock().now(); });
        },
        foxglove_protocols(), c.origins);
    router.headers(kPageHeaders);
    if (!c.token_file.empty()) {
      auto token = read_token(c.token_file);
      if (!token) return token.error();
      router.guard([token = *token](const auto& r) { return demand_token(r, token); });
    }
    http::Limits limits;
    limits.body_bytes = 64U << 10U;
    limits.answer_deadline = 60s;
    limits.streams = std::size_t(c.pages);
    limits.threads = 4;
    std::optional<http::TlsFiles> tls;
    if (c.tls()) tls = http::TlsFiles{c.tls_certificate, c.tls_key, c.tls_client_ca};
    auto server = http::Server::start(c.address, c.port, std::move(router), limits, tls);
    if (!server && server.error().code == ErrorCode::kConfiguration) return server.error();
    if (!server)
      return Error{ErrorCode::kResource, server.error().where, server.error().what,
                   "give gateway.address and gateway.port what is free"};
    server_ = std::move(*server);
    log_info("page and API: " + std::string(c.tls() ? "https" : "http") + "://" + c.address + ":" +
             std::to_string(server_->port()) + "/");
    return {};
  }

  void take_positions() {
    while (const auto sample = positions_in_->take()) {
      const v1::RangefinderPosition& p = **sample;
      ++context_.status.received;
      if (p.device_status() != v1::STATUS_OK) continue;
      const Axis axis = p.axis() == v1::AXIS_CART      ? Axis::kCart
                        : p.axis() == v1::AXIS_TROLLEY ? Axis::kTrolley
                                                       : Axis::kCartSecond;
      // What cannot be true is counted by the mapper.
      (void)gantry_.add(axis, p.stream(), p.time_ns(), p.distance_m());
      if (axis == Axis::kCartSecond) continue;
      newest_[axis == Axis::kCart ? 0 : 1] = p.time_ns();
      heard_[axis == Axis::kCart ? 0 : 1] = MonotonicClock().now();
    }
  }
  void take_hoist() {
    while (const auto sample = hoist_in_->take()) {
      ++context_.status.received;
      hoist_ = **sample;
      hoist_heard_ = MonotonicClock().now();
    }
  }
  void take_statuses() {
    while (const auto sample = statuses_in_->take()) {
      ++context_.status.received;
      statuses_[(*sample)->service()] = **sample;
    }
  }

  /// Whether there was anything.
  bool encode_tiles() {
    const client::Status s = map_->status();
    if (s.map_id != map_id_) {
      tiles_.begin_anew();
      map_id_ = s.map_id;
    }
    const std::set<TileAt> changed = changed_.take();
    std::vector<client::Height> columns(kTileEdge * kTileEdge);
    for (const TileAt at : changed) {
      for (int i = 0; i < kTileEdge * kTileEdge; ++i)
        columns[std::size_t(i)] =
            map_->height((at.x * kTileEdge + i % kTileEdge + 0.5) * s.voxel_m,
                         (at.y * kTileEdge + i / kTileEdge + 0.5) * s.voxel_m);
      tiles_.put(at, encode_tile(at, columns));
    }
    return !changed.empty();
  }

  /// Cart and trolley now [m, map]; nothing: not both are told, or not believed.
  [[nodiscard]] std::optional<Eigen::Vector2d> position() const {
    const TimeNs now = MonotonicClock().now();
    if (now - std::min(heard_[0], heard_[1]) > kPositionLives) return std::nullopt;
    const Gantry::Place place = gantry_.at(std::min(newest_[0], newest_[1]));
    if (place.known != PositionTrack::Lookup::kFound &&
        place.known != PositionTrack::Lookup::kUnconfirmed)
      return std::nullopt;
    return place.map_m;
  }

  [[nodiscard]] Json state(const client::Status& s) const {
    const TimeNs now = SystemClock().now();
    Json out{{"time_ms", now / 1'000'000},
             {"crane", context_.config.crane},
             {"generation", tiles_.generation()},
             {"map", to_json(s, now)},
             {"position", nullptr},
             {"footprint", Json::array()},
             {"hoist", nullptr}};
    if (const auto at = position()) {
      out["position"] = {{"x_m", at->x()}, {"y_m", at->y()}};
      if (rig_)
        for (const Eigen::Vector2d& p : footprint(*rig_, *at))
          out["footprint"].push_back(Json::array({p.x(), p.y()}));
    }
    if (hoist_is_fresh()) {
      out["hoist"] = to_json(*hoist_, now);
      const HoistConfig& h = context_.config.hoist;
      out["hoist"]["offset_m"] = Json::array({h.offset_x_m, h.offset_y_m});
    }
    Json zones = Json::array();
    for (const client::Zone& z : map_->zones()) zones.push_back(to_json(z));
    out["zones"] = std::move(zones);
    Json services = Json::array();
    for (const auto& [number, status] : statuses_) services.push_back(to_json(status, now));
    out["services"] = std::move(services);
    return out;
  }

  void tell_viewers(const client::Status& s) {
    const TimeNs time = std::min(newest_[0], newest_[1]);
    const Gantry::Place place = gantry_.at(time);
    if (place.known == PositionTrack::Lookup::kFound)
      viewers_told_.place(time, place.map_m, place.skew_rad, rig_,
                          hoist_is_fresh() ? hoist_ : std::nullopt);
    viewers_told_.tell(s, statuses_);
  }

  [[nodiscard]] bool hoist_is_fresh() const {
    return hoist_ && MonotonicClock().now() - hoist_heard_ < kHoistLives;
  }

  void tell(const client::Status& s) {
    StatusReporter& status = context_.status;
    status.status = s.valid && s.complete ? v1::STATUS_OK : v1::STATUS_DEGRADED;
    status.message = s.valid ? "" : s.reason;
    const http::Server::Counts counts = server_->counts();
    status.published = counts.answered;
    if (status.due())
      status.values = {{"gateway_pages", double(counts.streams)},
                       {"gateway_refused", double(counts.refused)},
                       {"gateway_cut_off", double(counts.cut_off)},
                       {"gateway_tiles", double(tiles_.size())}};
    status.tick();
  }

  ServiceContext& context_;
  std::optional<StereoRig> rig_;
  Gantry gantry_;
  Wakeup wakeup_;
  Changed changed_;
  StateBoard board_;
  TileLog tiles_;
  std::unique_ptr<client::Map> map_;
  Api api_;
  FoxgloveChannels viewers_;
  FoxgloveStates viewers_told_;
  std::unique_ptr<http::Server> server_;
  std::optional<FoxgloveSource> for_viewers_;
  std::optional<dds::Reader<dds::RangefinderPositionTopic>> positions_in_;
  std::optional<dds::Reader<dds::HoistStateTopic>> hoist_in_;
  std::optional<dds::Reader<dds::ServiceStatusTopic>> statuses_in_;
  TimeNs newest_[2] = {0, 0}, heard_[2] = {0, 0};
  std::optional<v1::HoistState> hoist_;
  TimeNs hoist_heard_ = 0;
  std::map<std::uint32_t, v1::ServiceStatus> statuses_;
  std::uint64_t map_id_ = 0, woken_ = 0;
  std::tuple<bool, std::uint32_t, std::uint64_t> said_{};
};

}  // namespace

Result<void> serve(ServiceContext& context, const std::string& calibration,
                   const std::string& page_folder) {
  std::optional<StereoRig> rig;
  if (!calibration.empty()) {
    auto read = read_rig(calibration);
    if (!read) return read.error();
    rig = *read;
  }
  std::string why;
  auto map = client::Map::join(context.participant->fast_dds(), map_options(context.config), why);
  if (!map)
    return Error{ErrorCode::kResource, "map", "cannot be followed: " + why,
                 "check dds in the configuration"};
  Watcher watcher(context, std::move(rig), std::move(map));
  if (auto started = watcher.start(page_folder); !started) return started;
  return watcher.run();
}

}  // namespace crane::gateway
