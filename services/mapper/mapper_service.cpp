#include "mapper/mapper_service.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <optional>
#include <random>

#include "base/log.hpp"
#include "bounds.h"
#include "config/site_config.hpp"
#include "mapper/map_builder.hpp"
#include "mapper/map_publisher.hpp"
#include "mapper/map_store.hpp"
#include "mapper/standby.hpp"
#include "mapper/succession.hpp"
#include "mapper/zone_book.hpp"
#include "recording/calibration.hpp"
#include "service/every.hpp"
#include "service/run_service.hpp"
#include "service/stream_gate.hpp"

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
    std::optional<dds::Reader<dds::PartialCloudTopic>> clouds;
    if (auto made = read_clouds(clouds); !made) return made;
    auto positions =
        dds::Reader<dds::RangefinderPositionTopic>::create(context_.participant, &wakeup_);
    if (!positions) return positions.error();
    identity_.mapper = random_id();
    identity_.mapper_start = SystemClock().now();
    auto succession = Succession::create(context_.participant, &wakeup_, identity_.mapper);
    if (!succession) return succession.error();
    auto hoist = dds::Reader<dds::HoistStateTopic>::create(context_.participant, &wakeup_);
    if (!hoist) return hoist.error();
    auto requests = dds::Reader<dds::TileRequestTopic>::create(context_.participant, &wakeup_);
    if (!requests) return requests.error();
    auto commands = dds::Reader<dds::ZoneCommandTopic>::create(context_.participant, &wakeup_);
    if (!commands) return commands.error();
    auto zones = ZoneBook::open(context_.config.zones, options_.state);
    if (!zones) return zones.error();

    const bool serving = succession->another_serves([this] { return context_.stopping(); });
    if (serving && !options_.standby)
      return Error{
          ErrorCode::kResource, "map_status",
          "another mapper already serves crane " + std::to_string(crane()) + " in this domain",
          "stop it, give this one another crane number or dds.domain, or start it with --standby"};
    MapStore store(options_.state);
    std::uint64_t revision = 0;
    if (serving) {
      clouds.reset();  // 74 MB/s that a standby does not use
      auto taken = stand_by(*positions, *hoist, *commands, *requests, *zones, store);
      if (!taken) return taken.error();
      if (!*taken) return {};  // stopped before it was needed
      revision = **taken;
      if (auto made = read_clouds(clouds); !made) return made;
    } else {
      auto loaded = begin(store);
      if (!loaded) return loaded.error();
      revision = *loaded;
    }
    auto zone_sets = dds::Writer<dds::ZoneSetTopic>::create(
        context_.participant, dds::ZoneSetTopic::kName, identity_.term);
    if (!zone_sets) return zone_sets.error();
    auto publisher =
        MapPublisher::create(context_.participant, identity_,
                             context_.config.mapper.method == MapperConfig::Method::kPaper);
    if (!publisher) return publisher.error();
    publisher->restore_revision(revision);
    if (auto sent = zone_sets->write(zones->set(crane(), identity_.map_id)); !sent) return sent;
    zones_revision_ = zones->revision();
    if (serving) {
      // Subscribers hold the same map already; that of a large hall takes a while to go out, and
      // all of it does before the next heartbeat says that it is there.
      if (taken_over_) publisher->take_over(*taken_over_);
      if (auto sent = publisher->publish_tiles(builder_, true); !sent) return sent;
      beat(*publisher);
    }
    log_info("serving crane " + std::to_string(crane()) + ", voxel " +
             std::to_string(builder_.voxel_m()) + " m, term " + std::to_string(identity_.term));

    const MapperConfig& config = context_.config.mapper;
    Every heartbeat(5), tiles(config.publish_hz), rest(1), octree(config.octree_hz), again(20);
    while (!context_.stopping()) {
      wakeup_.wait_for(20ms);
      if (auto alone = succession->check_right(identity_.term); !alone) return alone;
      take_positions(*positions);
      take_hoist(*hoist);
      if (auto done = take_commands(*commands, *zones, *zone_sets); !done) return done;
      if (context_.reload())
        if (auto done = reload(*zones, *zone_sets); !done) return done;
      while (const auto request = requests->take()) {
        if (!again.due()) {  // whoever asks asks again
          builder_.dropped.add("tile_request too soon after another");
          continue;
        }
        if (auto done = publisher->send_again(builder_, **request); !done) return done;
      }
      zones_revision_ = zones->revision();
      bool accounted = take_clouds(*clouds);
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
      cloud_counts_ = clouds->counts();
      position_counts_ = positions->counts();
      hoist_counts_ = hoist->counts();
      request_counts_ = requests->counts();
      command_counts_ = commands->counts();
      report(*publisher);
      context_.status.tick();
    }
    return finish(*publisher, store);
  }

 private:
  Result<void> read_clouds(std::optional<dds::Reader<dds::PartialCloudTopic>>& into) {
    auto made = dds::Reader<dds::PartialCloudTopic>::create(context_.participant, &wakeup_);
    if (!made) return made.error();
    into.emplace(std::move(*made));
    return {};
  }

  [[nodiscard]] std::uint32_t crane() const { return context_.participant->settings().crane; }

  /// A new map, or the one on disk: what subscribers hold of an earlier life is void, even where
  /// its content goes on. Returns the revision.
  Result<std::uint64_t> begin(MapStore& store) {
    identity_.map_id = random_id();
    identity_.term = Succession::next_term(0);
    if (options_.state.empty()) return std::uint64_t{0};
    auto state = store.load(builder_);
    if (!state) return state.error();
    if (state->found)
      log_info("goes on with saved map: revision " + std::to_string(state->revision) + ", frame " +
               std::to_string(state->account.last_frame));
    return state->revision;
  }

  /// Follows the mapper that serves until it is silent. Returns the revision to go on from; nothing
  /// when the service is to stop.
  Result<std::optional<std::uint64_t>> stand_by(
      dds::Reader<dds::RangefinderPositionTopic>& positions,
      dds::Reader<dds::HoistStateTopic>& hoist, dds::Reader<dds::ZoneCommandTopic>& commands,
      dds::Reader<dds::TileRequestTopic>& requests, ZoneBook& zones, MapStore& store) {
    auto made = Standby::create(context_.participant, &wakeup_);
    if (!made) return made.error();
    Standby& standby = *made;
    log_info("standing by: another mapper serves crane " + std::to_string(crane()));
    StatusReporter& status = context_.status;
    status.serve_as(v1::SERVICE_STANDBY);
    bool cut_off = false;
    while (!context_.stopping()) {
      wakeup_.wait_for(20ms);
      if (auto done = standby.step(builder_); !done) return done.error();
      take_positions(positions);
      take_hoist(hoist);
      while (commands.take()) {  // the mapper that serves does what they say
      }
      while (requests.take()) {
      }
      if (context_.reload()) log_warning("SIGHUP: a standby reads nothing again");
      const bool silent = standby.silent();
      // With the rangefinders silent too it is us who are cut off: nobody would be served.
      const bool witness = std::chrono::steady_clock::now() - position_heard_ < 1s;
      if (silent && !witness && !cut_off)
        log_error("neither the mapper nor a rangefinder is heard: waits until one is");
      cut_off = silent && !witness;
      status.status = cut_off || !standby.current() ? v1::STATUS_DEGRADED : v1::STATUS_OK;
      status.message = cut_off             ? "hears neither the mapper nor a rangefinder"
                       : standby.current() ? "holds the map that is served"
                                           : "does not hold all of the map";
      status.values = {{"map_tiles", double(builder_.map().tile_count())}};
      status.tick();
      if (!silent || !witness) continue;
      // The same map to subscribers, if it is: they hold it already.
      const v1::MapStatus& last = *standby.said();
      identity_.map_id = standby.current() ? last.map_id() : random_id();
      identity_.term = Succession::next_term(static_cast<int>(last.term()));
      if (standby.current()) taken_over_ = last;
      if (standby.zones()) zones.follow(*standby.zones());
      status.serve_as(v1::SERVICE_MAPPER);
      log_warning("the mapper is silent: takes over crane " + std::to_string(crane()) + " with " +
                  std::to_string(builder_.map().tile_count()) + " tiles" +
                  (standby.current() ? "" : ", not all that there were"));
      if (auto cleared = store.clear(); !cleared) note_unsaved(cleared.error().text());
      // Tiles of a later revision than the last heartbeat may have gone out.
      return std::optional(last.revision() + 100);
    }
    return std::optional<std::uint64_t>();
  }

  void take_positions(dds::Reader<dds::RangefinderPositionTopic>& positions) {
    while (const auto sample = positions.take()) {
      const v1::RangefinderPosition& p = **sample;
      const Axis axis = p.axis() == v1::AXIS_CART ? Axis::kCart : Axis::kTrolley;
      position_heard_ = std::chrono::steady_clock::now();
      if (!position_gates_[axis == Axis::kCart ? 0 : 1].pass(p.stream())) {
        builder_.dropped.add("position of a second rangefinder on one axis");
        continue;
      }
      if (p.device_status() == v1::STATUS_OK)
        builder_.add_position(axis, p.stream(), p.time_ns(), p.distance_m());
      else
        builder_.add_failed_position(axis);
    }
  }

  void take_hoist(dds::Reader<dds::HoistStateTopic>& hoist) {
    while (const auto sample = hoist.take()) {
      const v1::HoistState& h = **sample;
      if (h.status() == v1::STATUS_FAILED) {
        builder_.add_failed_hoist();
        continue;
      }
      HoistReading r;
      r.time = h.time_ns();
      r.hook_height_m = h.hook_height_m();
      r.sling_m = h.sling_m();
      r.load_size_m = {h.load_size_x_m(), h.load_size_y_m(), h.load_size_z_m()};
      r.load_yaw_rad = h.load_yaw_rad();
      r.sway_m = {h.sway_x_m(), h.sway_y_m()};
      builder_.add_hoist(r);
    }
  }

  Result<void> take_commands(dds::Reader<dds::ZoneCommandTopic>& commands, ZoneBook& zones,
                             dds::Writer<dds::ZoneSetTopic>& sets) {
    while (const auto command = commands.take()) {
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

  bool take_clouds(dds::Reader<dds::PartialCloudTopic>& clouds) {
    bool accounted = false;
    while (!context_.stopping()) {
      const auto sample = clouds.take();
      if (!sample) break;
      ++context_.status.received;
      context_.status.stream = (*sample)->stream();
      add_delivery_times(builder_.stages, "stereo to mapper", *sample, clouds.counts());
      if (!cloud_gate_.pass((*sample)->stream())) {
        builder_.dropped.add("cloud of a second camera");
        continue;
      }
      CloudSample cloud = copy(**sample);
      if (sample->intact())
        builder_.add_cloud(std::move(cloud), MonotonicClock().now());
      else
        builder_.dropped.add("cloud overwritten before it was read");
      while (builder_.step(MonotonicClock().now())) accounted = true;
    }
    while (builder_.step(MonotonicClock().now())) accounted = true;
    return accounted;
  }

  /// Memory of its own: the writer may reuse the sample while the cloud waits for positions.
  static CloudSample copy(const v1::PartialCloud& c) {
    CloudSample out;
    const std::size_t pixels = std::size_t(c.width()) * c.height();
    out.stream = c.stream();
    out.sequence_number = c.sequence_number();
    out.after = c.after();
    out.exposure_time = c.exposure_time_ns();
    out.sent_time = c.frame_sent_ns();
    out.depth_m.assign(c.depth().begin(), c.depth().begin() + pixels);
    out.confidence.assign(c.confidence().begin(), c.confidence().begin() + pixels);
    if (c.has_colour() == 1) out.colour.assign(c.colour().begin(), c.colour().begin() + 3 * pixels);
    for (int i = 0; i < 9; ++i)
      out.R_camera_rectified(i / 3, i % 3) = c.rotation()[static_cast<std::size_t>(i)];
    out.frame.width = c.width();
    out.frame.height = c.height();
    out.frame.f_px = c.f_px();
    out.frame.cx_px = c.cx_px();
    out.frame.cy_px = c.cy_px();
    out.frame.baseline_m = c.baseline_m();
    out.frame.sigma_disparity_px = c.sigma_disparity_px();
    return out;
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

  void report(const MapPublisher& publisher) {
    StatusReporter& s = context_.status;
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
    add_reader_drops(s.dropped, "cloud", cloud_counts_);
    add_reader_drops(s.dropped, "position", position_counts_);
    add_reader_drops(s.dropped, "hoist_state", hoist_counts_);
    add_reader_drops(s.dropped, "tile_request", request_counts_);
    add_reader_drops(s.dropped, "zone_command", command_counts_);
  }

  Result<void> finish(MapPublisher& publisher, MapStore& store) {
    if (auto done = hand_on(publisher, store, true); !done) return done;
    if (auto done = publisher.publish_octree(builder_); !done) return done;
    beat(publisher);
    publisher.flush(1s);
    if (options_.save.empty()) return {};
    const Stopwatch watch;
    auto saved = save_map(builder_, options_.save);
    builder_.stages.add("save map", watch.ms());
    report(publisher);
    if (saved) log_info("map saved in " + options_.save);
    return saved;
  }

  ServiceContext& context_;
  const Options& options_;
  MapBuilder builder_;
  MapPublisher::Identity identity_;
  Wakeup wakeup_;
  StreamGate cloud_gate_;
  std::array<StreamGate, 2> position_gates_;  ///< cart, trolley
  std::chrono::steady_clock::time_point position_heard_{};
  dds::ReaderCounts cloud_counts_, position_counts_, hoist_counts_, request_counts_,
      command_counts_;
  std::uint64_t zones_revision_ = 0;
  std::optional<v1::MapStatus> taken_over_;      ///< the last heartbeat of the mapper before us
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
