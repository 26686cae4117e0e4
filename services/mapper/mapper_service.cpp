#include "mapper/mapper_service.hpp"

#include <CLI/CLI.hpp>
#include <optional>
#include <random>

#include "base/log.hpp"
#include "config/site_config.hpp"
#include "mapper/map_builder.hpp"
#include "mapper/map_publisher.hpp"
#include "mapper/map_store.hpp"
#include "mapper/mapper_inputs.hpp"
#include "mapper/standby.hpp"
#include "mapper/succession.hpp"
#include "mapper/zone_book.hpp"
#include "recording/calibration.hpp"
#include "service/every.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

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
        builder_(context.config.mapper, rig, context.config.hoist) {}

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
    return serve(*inputs, *succession, *zones, store);
  }

 private:
  Result<void> serve(MapperInputs& inputs, Succession& succession, ZoneBook& zones,
                     MapStore& store) {
    auto zone_sets = dds::Writer<dds::ZoneSetTopic>::create(
        context_.participant, dds::ZoneSetTopic::kName, identity_.term);
    if (!zone_sets) return zone_sets.error();
    auto publisher =
        MapPublisher::create(context_.participant, identity_,
                             context_.config.mapper.method == MapperConfig::Method::kPaper);
    if (!publisher) return publisher.error();
    publisher->restore_revision(first_revision_);
    if (auto sent = zone_sets->write(zones.set(crane(), identity_.map_id)); !sent) return sent;
    zones_revision_ = zones.revision();
    if (took_over_) {
      // Subscribers hold the same map already; that of a large hall takes a while to go out, and
      // all of it does before the next heartbeat says that it is there.
      if (last_heard_) publisher->take_over(*last_heard_);
      if (auto sent = publisher->publish_tiles(builder_, true); !sent) return sent;
      beat(*publisher);
    }
    log_info("serving crane " + std::to_string(crane()) + ", voxel " +
             std::to_string(builder_.voxel_m()) + " m, term " + std::to_string(identity_.term));

    const MapperConfig& config = context_.config.mapper;
    Every heartbeat(5), tiles(config.publish_hz), rest(1), octree(config.octree_hz), again(20);
    while (!context_.stopping()) {
      wakeup_.wait_for(20ms);
      if (auto alone = succession.check_right(identity_.term); !alone) return alone;
      inputs.take_motion(builder_);
      if (auto done = take_commands(inputs, zones, *zone_sets); !done) return done;
      if (context_.reload())
        if (auto done = reload(zones, *zone_sets); !done) return done;
      while (const auto request = inputs.take_request()) {
        if (!again.due()) {  // whoever asks asks again
          builder_.dropped.add("tile_request too soon after another");
          continue;
        }
        if (auto done = publisher->send_again(builder_, **request); !done) return done;
      }
      zones_revision_ = zones.revision();
      const bool accounted = inputs.take_clouds(builder_, [this] { return context_.stopping(); });
      if (accounted ? tiles.due() : rest.due()) {
        builder_.rest(MonotonicClock().now());
        if (auto done = hand_on(*publisher, store, false); !done) return done;
        if (accounted)
          builder_.stages.add(
              "frame to published tiles",
              double(SystemClock().now() - builder_.account().last_frame_sent) * 1e-6);
      }
      if (octree.due())
        if (auto done = publisher->publish_octree(builder_); !done) return done;
      if (heartbeat.due() || accounted) beat(*publisher);
      report(inputs, *publisher);
      context_.status.tick();
    }
    return finish(inputs, *publisher, store);
  }

  [[nodiscard]] std::uint32_t crane() const { return context_.participant->settings().crane; }

  /// A new map, or the one on disk: what subscribers hold of an earlier life is void, even where
  /// its content goes on.
  Result<void> begin(MapStore& store) {
    identity_.map_id = random_id();
    identity_.term = Succession::next_term(0);
    if (options_.state.empty()) return {};
    auto state = store.load(builder_);
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
    auto standby = Standby::create(context_.participant, &wakeup_);
    if (!standby) return standby.error();
    log_info("standing by: another mapper serves crane " + std::to_string(crane()));
    auto needed = standby->wait(context_, inputs, builder_);
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
                std::to_string(builder_.map().tile_count()) + " tiles" +
                (current ? "" : ", not all that there were"));
    if (auto cleared = store.clear(); !cleared) note_unsaved(cleared.error().text());
    return true;
  }

  Result<void> take_commands(MapperInputs& inputs, ZoneBook& zones,
                             dds::Writer<dds::ZoneSetTopic>& sets) {
    while (const auto command = inputs.take_command()) {
      const std::uint64_t before = zones.revision();
      if (auto done = zones.apply(**command); !done) {
        log_warning(done.error().text());
        builder_.dropped.add("zone_command refused or not saved");
      }
      if (zones.revision() == before) continue;
      if (auto sent = sets.write(zones.set(crane(), identity_.map_id)); !sent) return sent;
    }
    return {};
  }

  /// SIGHUP: the zones of the configuration as they are now. A bad file changes nothing.
  Result<void> reload(ZoneBook& zones, dds::Writer<dds::ZoneSetTopic>& sets) {
    if (context_.config_file.empty()) {
      log_warning("SIGHUP: nothing to read again, there is no --config");
      return {};
    }
    auto read = read_site_config(context_.config_file);
    if (!read) {
      log_error("SIGHUP: the zones stay as they are: " + read.error().text());
      return {};
    }
    SiteConfig rest = *read;
    rest.zones = context_.config.zones;
    if (to_yaml(rest) != to_yaml(context_.config))
      log_warning("SIGHUP: only zones are taken; what else changed needs a restart");
    context_.config.zones = read->zones;
    if (auto done = zones.reload(read->zones); !done) log_warning(done.error().text());
    log_info("zones read again: " + std::to_string(read->zones.size()) + " in " +
             context_.config_file);
    return sets.write(zones.set(crane(), identity_.map_id));
  }

  /// Tiles to the network, and to disk where asked for. The paper's method makes its map anew
  /// first, but only while no cloud waits: it takes seconds.
  Result<void> hand_on(MapPublisher& publisher, MapStore& store, bool last) {
    const bool idle = MonotonicClock().now() - builder_.last_arrival() > kNsPerSecond / 2;
    if (builder_.needs_rebuild() && (last || idle))
      if (auto made = builder_.rebuild(); !made) return made;
    store.note_changes(builder_);
    if (auto saved = keep(publisher, store, last); !saved) return saved;
    if (builder_.map().changed_tiles().empty()) return {};
    return publisher.publish_tiles(builder_, last);
  }

  /// The map on disk, where asked for. A disk that is full or broken does not end the map: it is
  /// said, and tried again, until the last time.
  Result<void> keep(const MapPublisher& publisher, MapStore& store, bool last) {
    if (options_.state.empty() || !store.unsaved()) return {};
    if (!last && !save_state_.due()) return {};
    const Stopwatch watch;
    if (last) (void)store.finish();  // what it met, the next line meets again
    auto saved = store.save(builder_, {true, publisher.revision() + 1, builder_.account()});
    if (last) return saved ? store.finish() : saved;
    note_unsaved(store.trouble());
    builder_.stages.add("save state", watch.ms());
    return {};
  }

  void note_unsaved(const std::string& trouble) {
    if (unsaved_.empty() && !trouble.empty()) log_error("the map is not kept on disk: " + trouble);
    if (!unsaved_.empty() && trouble.empty()) log_info("the map is kept on disk again");
    if (!trouble.empty()) builder_.dropped.add("state not saved");
    unsaved_ = trouble;
  }

  void beat(MapPublisher& publisher) {
    std::uint32_t validity = v1::STATUS_OK;
    std::string reason;
    if (builder_.account().last_frame < 0) {
      validity = v1::STATUS_FAILED;
      reason = "no cloud could be placed yet";
    } else if (MonotonicClock().now() - builder_.last_arrival() >
               TimeNs(context_.config.mapper.stale_ms) * 1'000'000) {
      validity = v1::STATUS_DEGRADED;
      reason = "no cloud for more than " + std::to_string(context_.config.mapper.stale_ms) + " ms";
    }
    if (builder_.needs_rebuild()) {
      validity = v1::STATUS_DEGRADED;
      reason = "paper: the map is made anew when no cloud waits";
    }
    if (validity == v1::STATUS_OK && builder_.hoist() == HoistKnown::kLost) {
      validity = v1::STATUS_DEGRADED;
      reason = "no hoist_state: what hangs below the trolley is not known";
    }
    // No cloud yet is no failure of the service.
    said_validity_ = validity == v1::STATUS_OK ? v1::STATUS_OK : v1::STATUS_DEGRADED;
    said_reason_ = reason;
    publisher.publish_status(builder_,
                             {validity, reason, zones_revision_, context_.config.mapper.forget_s});
  }

  void report(const MapperInputs& inputs, const MapPublisher& publisher) {
    StatusReporter& s = context_.status;
    s.received = inputs.clouds_received();
    s.stream = inputs.stream();
    s.status = unsaved_.empty() ? said_validity_
                                : std::max<std::uint32_t>(said_validity_, v1::STATUS_DEGRADED);
    s.message = unsaved_.empty() ? said_reason_ : "the map is not kept on disk: " + unsaved_;
    s.values = {{"map_revision", double(publisher.revision())},
                {"map_tiles", double(builder_.map().tile_count())},
                {"map_memory_bytes", double(builder_.map().memory_bytes())},
                {"map_frames_integrated", double(builder_.account().integrated)},
                {"map_frames_missing", double(builder_.account().missing)},
                {"map_last_exposure_seconds", double(builder_.account().last_frame_time) * 1e-9}};
    s.published = publisher.published_tiles();
    s.stages = builder_.stages;
    s.stages.merge(publisher.stages);
    s.dropped = builder_.dropped;
    for (const auto& [cause, count] : publisher.dropped.counts()) s.dropped.add(cause, count);
    inputs.add_drops(s.dropped);
  }

  Result<void> finish(const MapperInputs& inputs, MapPublisher& publisher, MapStore& store) {
    if (auto done = hand_on(publisher, store, true); !done) return done;
    if (auto done = publisher.publish_octree(builder_); !done) return done;
    beat(publisher);
    publisher.flush(1s);
    if (options_.save.empty()) return {};
    const Stopwatch watch;
    auto saved = save_map(builder_, options_.save);
    builder_.stages.add("save map", watch.ms());
    report(inputs, publisher);
    if (saved) log_info("map saved in " + options_.save);
    return saved;
  }

  ServiceContext& context_;
  const Options& options_;
  MapBuilder builder_;
  MapPublisher::Identity identity_;
  Wakeup wakeup_;
  std::uint64_t first_revision_ = 0, zones_revision_ = 0;
  bool took_over_ = false;
  std::optional<v1::MapStatus> last_heard_;      ///< of the mapper before us, if its map is ours
  std::uint32_t said_validity_ = v1::STATUS_OK;  ///< with the last heartbeat
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
      v1::SERVICE_MAPPER, true};
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
        if (auto fits = MapBuilder::check(context.config.mapper, *rig); !fits) return fits;
        return Service(context, options, *rig).run();
      });
}

}  // namespace crane
