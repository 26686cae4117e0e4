// SPDX-License-Identifier: Apache-2.0
#include "mapper/mapper_service.hpp"

#include <CLI/CLI.hpp>
#include <optional>
#include <random>

#include "base/log.hpp"
#include "config/site_config.hpp"
#include "mapper/heartbeat.hpp"
#include "mapper/map_gauges.hpp"
#include "mapper/map_publisher.hpp"
#include "mapper/map_store.hpp"
#include "mapper/map_validity.hpp"
#include "mapper/mapper_inputs.hpp"
#include "mapper/standby.hpp"
#include "mapper/succession.hpp"
#include "mapper/zone_book.hpp"
#include "mapper/zone_desk.hpp"
#include "mapping_pipeline/mapping_pipeline.hpp"
#include "recording/calibration.hpp"
#include "service/every.hpp"
#include "service/request_gate.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

constexpr int kCloudsATurn = 8;   ///< then tiles and commands have theirs
constexpr double kResendMs = 20;  ///< of tiles that are asked for, ten times a second

struct Options {
  std::string calibration, save, state;
  bool standby = false;
};

std::uint64_t random_id() {
  std::random_device device;
  return (std::uint64_t(device()) << 32U | device()) | 1U;
}

class Service {
 public:
  Service(ServiceContext& context, const Options& options, const StereoRig& rig)
      : context_(context),
        options_(options),
        pipeline_(context.config.mapper, rig, context.config.hoist, context.config.watchdog) {}

  Result<void> run() {
    // Before anything else: what is published from now on is not to be missed.
    auto inputs = MapperInputs::create(context_.participant, &wakeup_);
    if (!inputs) return inputs.error();
    if (auto done = inputs->begin_serving(); !done) return done;
    auto zones = ZoneBook::open(context_.config.zones, options_.state);
    if (!zones) return zones.error();
    identity_.mapper = random_id();
    identity_.mapper_start = SystemClock().now();
    auto succession = Succession::create(context_.participant, &wakeup_, identity_.mapper);
    if (!succession) return succession.error();

    MapStore store(options_.state);
    const bool another = succession->another_serves([this] { return context_.stopping(); });
    if (!another) {
      if (auto begun = begin(store); !begun) return begun;
    } else if (options_.standby) {
      inputs->end_serving();
      auto needed = stand_by(*inputs, *zones, store);
      if (!needed) return needed.error();
      if (!*needed) return {};  // stopped before it was
      if (auto done = inputs->begin_serving(); !done) return done;
    } else {
      return Error{
          ErrorCode::kResource, "map_status",
          "another mapper already serves crane " + std::to_string(crane()) + " in this domain",
          "stop it, give this one another crane number or dds.domain, or start it with --standby"};
    }
    for (;;) {
      auto served = serve(*inputs, *succession, *zones, store);
      if (!served) return served.error();
      if (*served == Served::kStopped) return {};
    }
  }

 private:
  enum class Served {
    kStopped,
    kTakesBack,  ///< a mapper without a map did not hear us: we go on with a higher term than its
  };

  Result<Served> serve(MapperInputs& inputs, Succession& succession, ZoneBook& zones,
                       MapStore& store) {
    auto zone_desk = ZoneDesk::create(context_, zones, identity_);
    if (!zone_desk) return zone_desk.error();
    auto publisher =
        MapPublisher::create(context_.participant, identity_,
                             context_.config.mapper.method == MapperConfig::Method::kPaper);
    if (!publisher) return publisher.error();
    auto heartbeat = Heartbeat::create(context_.participant, identity_);
    if (!heartbeat) return heartbeat.error();
    heartbeat_ = std::move(*heartbeat);
    heartbeat_->keep_on(std::chrono::milliseconds(context_.config.mapper.stale_ms));
    publisher->restore_revision(first_revision_);
    if (auto sent = zone_desk->say(); !sent) return sent.error();
    zones_revision_ = zones.revision();
    if (took_over_) {
      // Subscribers hold the same map already; that of a large hall takes a while to go out, and
      // all of it does before a heartbeat says more than the last one that they heard.
      if (last_heard_) heartbeat_->take_over(*last_heard_);
      if (auto sent = publisher->publish_tiles(pipeline_, true); !sent) return sent.error();
      beat(*publisher);
    }
    log_info("serving crane " + std::to_string(crane()) + ", voxel " +
             std::to_string(pipeline_.voxel_m()) + " m, term " + std::to_string(identity_.term));

    const MapperConfig& config = context_.config.mapper;
    Every heartbeats(5), tiles(config.publish_hz), rest(1), octree(config.octree_hz), again(20),
        resend(10);
    RequestGate<dds::ParticipantId> asks(500ms);  // who follows the map asks every 0.7 s at most
    while (!context_.stopping()) {
      wakeup_.wait_for(publisher->behind() ? 1ms : 20ms);
      heartbeat_->alive(pipeline_.last_arrival());
      if (const Succession::Rival rival =
              succession.look(identity_.term, pipeline_.map().tile_count());
          rival.term > 0) {
        if (!rival.began_anew) return succession.deposed_by(rival, identity_.term);
        take_back(rival, *publisher);
        return Served::kTakesBack;
      }
      inputs.take_motion(pipeline_);
      if (auto done = zone_desk->work(inputs, counts_); !done) return done.error();
      while (const auto request = inputs.take_request()) {
        if (!asks.pass(request->writer(), std::chrono::steady_clock::now()) || !again.due()) {
          counts_.add(Cause::kTileRequestTooSoon);  // whoever asks asks again
          continue;
        }
        publisher->note_request(**request);
        // It may be the zones that are missing: a sample of those is not asked for by itself.
        if (auto sent = zone_desk->say(); !sent) return sent.error();
      }
      // A fifth of the time, whoever asks for how much.
      if (publisher->owes() && resend.due())
        if (auto done = publisher->send_again(pipeline_, kResendMs); !done) return done.error();
      zones_revision_ = zones.revision();
      const bool accounted = map_clouds(inputs);
      if (accounted ? tiles.due() : rest.due() || publisher->behind()) {
        pipeline_.rest(MonotonicClock().now());
        if (auto done = hand_on(*publisher, store, false); !done) return done.error();
        if (accounted)
          status().stages.add(
              "frame to published tiles",
              double(SystemClock().now() - pipeline_.account().last_frame_sent) * 1e-6);
      }
      if (octree.due())
        if (auto done = publisher->publish_octree(pipeline_); !done) return done.error();
      if (heartbeats.due() || accounted) beat(*publisher);
      report(inputs, zones, *publisher);
    }
    if (auto done = finish(inputs, zones, *publisher, store); !done) return done.error();
    return Served::kStopped;
  }

  [[nodiscard]] StatusReporter& status() { return context_.status; }

  /// Clouds that came, one after the other into the map. True when a frame was accounted for.
  bool map_clouds(MapperInputs& inputs) {
    bool accounted = false;
    const auto step_all = [&] {
      while (const auto frame = pipeline_.step(MonotonicClock().now())) {
        accounted = true;
        for (const StageMs& stage : frame->stages) status().stages.add(stage.stage, stage.ms);
        tell_of(*frame);
      }
    };
    for (int n = 0; n < kCloudsATurn && !context_.stopping(); ++n) {
      auto cloud = inputs.take_cloud(status().stages);
      if (!cloud) break;
      pipeline_.add_cloud(std::move(*cloud), MonotonicClock().now());
      step_all();
    }
    step_all();
    return accounted;
  }

  /// The first frame of each kind that is not used is said; the others are counted.
  void tell_of(const FrameReport& frame) {
    if (frame.refused == said_refused_) return;
    said_refused_ = frame.refused;
    if (!frame.refused) return log_info("frames are used again");
    char where[96] = "";
    if (frame.refused == Cause::kContradictsMap)
      std::snprintf(where, sizeof where, " (what it sees was seen %.2f m along, %.2f m across)",
                    frame.fits_better_m.x(), frame.fits_better_m.y());
    log_warning("frame " + std::to_string(frame.sequence_number) +
                " is not used: " + std::string(cause_text(*frame.refused)) + where);
  }

  /// Somebody began with nothing because it did not hear us. Who has the map goes on, with a term
  /// that is higher, and all readers with it.
  void take_back(const Succession::Rival& rival, const MapPublisher& publisher) {
    log_warning("another mapper began anew (term " + std::to_string(rival.term) +
                "): this one, which has it, goes on");
    last_heard_ = publisher.status(pipeline_, health(publisher));
    identity_.term = Succession::next_term(rival.term);
    first_revision_ = publisher.revision() + 1;
    took_over_ = true;
    OccupancyMap& map = pipeline_.map();
    for (const TileKey key : map.tile_keys()) {  // to the readers of the new writers
      map.tile(key).reclassified = true;
      map.mark_changed(map.tile(key));
    }
  }

  [[nodiscard]] std::uint32_t crane() const { return context_.participant->settings().crane; }

  /// A new map, or the one on disk: what subscribers hold of an earlier life is void, even where
  /// its content goes on.
  Result<void> begin(MapStore& store) {
    identity_.map_id = random_id();
    identity_.term = Succession::next_term(0);
    if (options_.state.empty()) return {};
    auto state = store.load(pipeline_);
    if (!state) return state.error();
    if (state->found)
      log_info("goes on with saved map: revision " + std::to_string(state->revision) + ", frame " +
               std::to_string(state->account.last_frame));
    first_revision_ = state->revision;
    return {};
  }

  /// Holds the map of the mapper that serves until that is silent, and succeeds to it. False when
  /// the service is to stop.
  Result<bool> stand_by(MapperInputs& inputs, ZoneBook& zones, MapStore& store) {
    auto standby = Standby::create(context_.participant, &wakeup_,
                                   std::size_t(context_.config.mapper.max_memory_mib) << 20U);
    if (!standby) return standby.error();
    log_info("standing by: another mapper serves crane " + std::to_string(crane()));
    auto needed = standby->wait(context_, inputs, pipeline_);
    if (!needed || !*needed) return needed;
    // The same map to subscribers, if it is: they hold it already.
    const v1::MapStatus& last = *standby->said();
    const bool current = standby->current();
    identity_.map_id = current ? last.map_id() : random_id();
    identity_.term = Succession::next_term(static_cast<int>(last.term()));
    took_over_ = true;
    if (current) last_heard_ = last;
    first_revision_ = last.revision() + 100;  // later ones than the last heartbeat's may have gone
    if (standby->zones()) zones.follow(*standby->zones());
    log_warning("the mapper is silent: takes over crane " + std::to_string(crane()) + " with " +
                std::to_string(pipeline_.map().tile_count()) + " tiles" +
                (current ? "" : ", not all that there were"));
    if (auto cleared = store.clear(); !cleared) note_unsaved(cleared.error().text());
    return true;
  }

  /// Tiles to the network, and to disk where asked for. The paper's method makes its map anew
  /// first, but only while no cloud waits: it takes seconds.
  Result<void> hand_on(MapPublisher& publisher, MapStore& store, bool last) {
    const bool idle = MonotonicClock().now() - pipeline_.last_arrival() > kNsPerSecond / 2;
    if (pipeline_.needs_rebuild() && (last || idle)) {
      auto made = pipeline_.rebuild();
      if (!made) return made.error();
      for (const StageMs& stage : *made) status().stages.add(stage.stage, stage.ms);
    }
    store.note_changes(pipeline_);
    if (auto saved = keep(publisher, store, last); !saved) return saved;
    if (pipeline_.map().changed_tiles().empty()) return {};
    return publisher.publish_tiles(pipeline_, last);
  }

  /// The map on disk, where asked for. A disk that is full or broken does not end the map: it is
  /// said, and tried again, until the last time.
  Result<void> keep(const MapPublisher& publisher, MapStore& store, bool last) {
    if (options_.state.empty() || !store.unsaved()) return {};
    if (!last && !save_state_.due()) return {};
    const Stopwatch watch;
    if (last) (void)store.finish();  // what it met, the next line meets again
    auto saved = store.save(pipeline_, {true, publisher.revision() + 1, pipeline_.account()});
    if (last) return saved ? store.finish() : saved;
    note_unsaved(store.trouble());
    status().stages.add("save state", watch.ms());
    return {};
  }

  void note_unsaved(const std::string& trouble) {
    if (unsaved_.empty() && !trouble.empty()) log_error("the map is not kept on disk: " + trouble);
    if (!unsaved_.empty() && trouble.empty()) log_info("the map is kept on disk again");
    if (!trouble.empty()) counts_.add(Cause::kStateNotSaved);
    unsaved_ = trouble;
  }

  [[nodiscard]] MapPublisher::Health health(const MapPublisher& publisher) const {
    // A map that was made anew is no map before all of it is out.
    const bool being_made =
        pipeline_.needs_rebuild() || (pipeline_.paper_cloud() != nullptr && publisher.behind());
    MapPublisher::Health h =
        judge_validity(pipeline_.report(), being_made,
                       TimeNs(context_.config.mapper.stale_ms) * 1'000'000, MonotonicClock().now());
    h.zones_revision = zones_revision_;
    h.forget_s = context_.config.mapper.forget_s;
    return h;
  }

  void beat(const MapPublisher& publisher) {
    const MapPublisher::Health h = health(publisher);
    // No cloud yet is no failure of the service.
    said_validity_ = h.validity == v1::STATUS_OK ? v1::STATUS_OK : v1::STATUS_DEGRADED;
    said_reason_ = h.reason;
    said_code_ = h.reason_code;
    heartbeat_->say(publisher.status(pipeline_, h));
  }

  /// What the service says of itself: once a second, and `last`.
  void report(const MapperInputs& inputs, const ZoneBook& zones, MapPublisher& publisher,
              bool last = false) {
    StatusReporter& s = status();
    for (const StageMs& stage : publisher.take_stages()) s.stages.add(stage.stage, stage.ms);
    if (!last && !s.due()) return;
    s.received = inputs.clouds_received();
    s.stream = inputs.stream();
    s.status = unsaved_.empty() ? said_validity_
                                : std::max<std::uint32_t>(said_validity_, v1::STATUS_DEGRADED);
    s.message = unsaved_.empty() ? said_reason_ : "the map is not kept on disk: " + unsaved_;
    s.gauges =
        map_gauges({publisher.revision(), pipeline_.map().tile_count(),
                    pipeline_.map().memory_bytes(), said_validity_ == v1::STATUS_OK, said_code_},
                   pipeline_.account());
    s.values["watch_state"] = double(static_cast<int>(pipeline_.watchdog().state()));
    s.figures.clear();
    for (const WatchFigure& f : figures_of(pipeline_.watchdog()))
      s.figures.push_back({f.name, f.figure.value, f.figure.sigma});
    s.published = publisher.published_tiles();
    for (const DropCounts& counts :
         {counts_, pipeline_.report().counts, publisher.counts(), inputs.counts()})
      s.dropped.merge(counts);
    s.dropped.set(Cause::kStatusNotAccepted, heartbeat_->not_accepted());
    s.dropped.set(Cause::kZonesTooMany, zones.given_up());
    s.tick();
  }

  Result<void> finish(const MapperInputs& inputs, const ZoneBook& zones, MapPublisher& publisher,
                      MapStore& store) {
    if (auto done = hand_on(publisher, store, true); !done) return done;
    if (auto done = publisher.publish_octree(pipeline_); !done) return done;
    beat(publisher);
    publisher.flush(800ms);  // SIGTERM ends a service within 2 s, whoever does not read
    heartbeat_->flush(200ms);
    report(inputs, zones, publisher, true);
    if (options_.save.empty()) return {};
    const Stopwatch watch;
    auto saved = save_map(pipeline_, options_.save);
    status().stages.add("save map", watch.ms());
    if (saved) log_info("map saved in " + options_.save);
    return saved;
  }

  ServiceContext& context_;
  const Options& options_;
  MappingPipeline pipeline_;
  MapPublisher::Identity identity_;
  std::unique_ptr<Heartbeat> heartbeat_;
  DropCounts counts_;  ///< of what only this service knows
  std::optional<Cause> said_refused_;
  Wakeup wakeup_;
  std::uint64_t first_revision_ = 0, zones_revision_ = 0;
  bool took_over_ = false;
  std::optional<v1::MapStatus> last_heard_;      ///< of the mapper before us, if its map is ours
  std::uint32_t said_validity_ = v1::STATUS_OK;  ///< with the last heartbeat
  std::uint32_t said_code_ = v1::MAP_NOTHING_YET;
  std::string said_reason_;
  std::string unsaved_;  ///< why the last state is not on disk; empty: it is
  Every save_state_{2};  ///< what is younger is sent again, or lost in real time, after kill -9
};

}  // namespace

int run_mapper(int argc, char** argv) {
  Options options;
  const ServiceInfo info{
      "cranemap-mapper",
      "Clouds and positions to the map: topics partial_cloud and "
      "rangefinder_position in;\nmap_tile, height_tile, octree_map and map_status "
      "out.\nExample: cranemap-mapper --calibration RECORDING --save OUT",
      v1::SERVICE_MAPPER};
  return run_service(
      argc, argv, info,
      [&](CLI::App& app) {
        app.add_option("--calibration", options.calibration,
                       "Folder with cam0/sensor.yaml, cam1/sensor.yaml and rig.yaml")
            ->required();
        app.add_option("--save", options.save, "Folder for map.bt, map.ot and map.pcd at the end");
        app.add_option("--state", options.state,
                       "Folder that keeps the map over a restart, kill -9 included");
        app.add_flag("--standby", options.standby,
                     "Where another mapper serves the crane: hold its map, and take over when it "
                     "falls silent.\nFor both of a pair, on two hosts, restarted when they end");
      },
      [&](ServiceContext& context) -> Result<void> {
        auto rig = read_rig(options.calibration);
        if (!rig) return rig.error();
        if (options.standby && context.config.mapper.method == MapperConfig::Method::kPaper)
          return Error{ErrorCode::kConfiguration, "--standby", "does not go with method: paper",
                       ""};
        if (auto fits = MappingPipeline::check(context.config.mapper, *rig); !fits) return fits;
        return Service(context, options, *rig).run();
      });
}

}  // namespace crane
