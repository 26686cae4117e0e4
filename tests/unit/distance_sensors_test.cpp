// SPDX-License-Identifier: Apache-2.0
// Rangefinders: what their telegrams say, against emulators written from the same manuals.

#include "sensors/distance/distance_device.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <deque>
#include <random>
#include <thread>

#include "sensors/distance/byte_link.hpp"
#include "sensors/distance/distance_protocol.hpp"
#include "sensors/distance/emulators.hpp"
#include "sensors/distance/telegram_frames.hpp"

namespace crane {
namespace {

using Device = RangefinderConfig::Device;
using Kind = DeviceSaid::Kind;
using namespace std::chrono_literals;

RangefinderConfig config_of(Device device, bool polled = false) {
  RangefinderConfig c;
  c.device = device;
  c.polled = polled;
  c.port = "/dev/null";
  if (device == Device::kSickDl50 || device == Device::kText || device == Device::kWcs)
    c.unit_m = 1e-3;
  if (device == Device::kText && polled) c.question = "?\\r\\n";
  if (device == Device::kTelegram) {
    c.port = "udp://127.0.0.1:2000";
    c.unit_m = 1e-3;
    c.telegram = {.length = 12, .value_offset = 4, .heartbeat_offset = 0};
  }
  return c;
}

const std::vector<RangefinderConfig> kAll = {config_of(Device::kSickDl100),
                                             config_of(Device::kSickDl100, true),
                                             config_of(Device::kSickDl50),
                                             config_of(Device::kSickDl50, true),
                                             config_of(Device::kSickDt1000, true),
                                             config_of(Device::kDimetix),
                                             config_of(Device::kDimetix, true),
                                             config_of(Device::kBenewake),

                                             config_of(Device::kLeuzeBps, true),
                                             config_of(Device::kWcs, true),
                                             config_of(Device::kText),
                                             config_of(Device::kText, true),
                                             config_of(Device::kTelegram)};

std::string name_of(const RangefinderConfig& c) {
  return device_name(c.device) + (c.polled ? ", polled" : "");
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// A host and a device on one line.
struct Line {
  explicit Line(const RangefinderConfig& c)
      : protocol(make_distance_protocol(c)), emulator(make_distance_emulator(c)) {
    // The unit that the configuration left to its maker, on both sides.
    host_sends(protocol->begin(), {});
  }
  void host_sends(const std::string& text, const EmulatedMeasurement& now) {
    device_sends(emulator->hear(text, now));
  }
  void device_sends(const std::string& text) {
    if (!text.empty()) protocol->take(bytes_of(text), talk);
  }
  /// One round: question, answer, stream.
  DeviceTalk round(const EmulatedMeasurement& now) {
    talk.clear();
    host_sends(protocol->ask(asked++), now);
    device_sends(emulator->stream(now));
    return talk;
  }
  std::unique_ptr<DistanceProtocol> protocol;
  std::unique_ptr<DistanceEmulator> emulator;
  DeviceTalk talk;
  std::uint64_t asked = 0;
};

std::vector<double> distances(const DeviceTalk& talk) {
  std::vector<double> out;
  for (const DeviceSaid& said : talk)
    if (said.kind == Kind::kDistance) out.push_back(said.value);
  return out;
}

bool says(const DeviceTalk& talk, Kind kind) {
  for (const DeviceSaid& said : talk)
    if (said.kind == kind) return true;
  return false;
}

TEST(DistanceProtocols, ReadWhatEachDeviceMeasures) {
  for (const RangefinderConfig& c : kAll) {
    Line line(c);
    for (const double metres : {0.5, 1.234, 7.89, 12.0, 31.005}) {
      const auto read = distances(line.round({.distance_m = metres}));
      ASSERT_EQ(read.size(), 1U) << name_of(c);
      const double unit = c.device == Device::kBenewake ? 0.01 : 0.001;
      EXPECT_NEAR(read[0], metres, unit / 2 + 1e-9) << name_of(c);
    }
    EXPECT_EQ(line.protocol->damaged(), 0U) << name_of(c);
  }
}

TEST(DistanceProtocols, NoTargetIsNeverADistance) {
  for (const RangefinderConfig& c : kAll) {
    if (c.device == Device::kTelegram) continue;  // 0 is a position that a PLC may have
    Line line(c);
    const DeviceTalk talk = line.round({.distance_m = 5, .no_target = true});
    EXPECT_TRUE(distances(talk).empty()) << name_of(c);
    EXPECT_TRUE(says(talk, Kind::kNoDistance)) << name_of(c);
  }
}

TEST(DistanceProtocols, AFaultOrDirtIsSaid) {
  for (const RangefinderConfig& c : kAll) {
    if (c.device == Device::kSickDl100 || c.device == Device::kLeuzeBps ||
        c.device == Device::kWcs) {
      Line line(c);
      bool warned = false;
      for (int i = 0; i < 25; ++i)
        warned |= says(line.round({.distance_m = 5, .dirty = true}), Kind::kWarning);
      EXPECT_TRUE(warned) << name_of(c);
      EXPECT_EQ(distances(line.round({.distance_m = 5, .dirty = true})).size(), 1U) << name_of(c);
    }
    if (c.device == Device::kSickDl50 || c.device == Device::kSickDt1000 ||
        c.device == Device::kBenewake || c.device == Device::kText)
      continue;  // have no way to say so
    Line line(c);
    for (int i = 0; i < 25; ++i) line.round({.distance_m = 5, .broken = true});
    const DeviceTalk talk = line.round({.distance_m = 5, .broken = true});
    EXPECT_TRUE(says(talk, Kind::kFault)) << name_of(c);
    EXPECT_TRUE(distances(talk).empty()) << name_of(c);
    for (int i = 0; i < 25; ++i) line.round({.distance_m = 5});
    EXPECT_EQ(distances(line.round({.distance_m = 5})).size(), 1U) << "well again: " << name_of(c);
  }
}

TEST(DistanceProtocols, TelegramsInAnyPiecesAreTheSame) {
  std::mt19937 random(7);
  for (const RangefinderConfig& c : kAll) {
    // Datagrams are whole; an answer of a Leuze's or a WCS's is one by its question.
    if (c.device == Device::kTelegram || c.device == Device::kLeuzeBps || c.device == Device::kWcs)
      continue;
    Line line(c);
    std::string all;
    for (int i = 1; i <= 50; ++i) {
      const EmulatedMeasurement now{.distance_m = i * 0.25};
      all += line.emulator->hear(line.protocol->ask(1), now) + line.emulator->stream(now);
    }
    line.talk.clear();
    for (std::size_t at = 0; at < all.size();) {
      const std::size_t n = 1 + random() % 7;
      line.device_sends(all.substr(at, n));
      at += n;
    }
    EXPECT_EQ(distances(line.talk).size(), 50U) << name_of(c);
  }
}

TEST(DistanceProtocols, ABitThatFlipsOnTheLineHardlyEverBecomesADistanceAndTheNextTelegramIsRead) {
  std::mt19937 random(3);
  for (const RangefinderConfig& c : kAll) {
    if (c.device == Device::kTelegram) continue;
    // Text without a checksum: digits that become other digits cannot be told. They are caught by
    // what cranes cannot do (mapper.largest_speed_mps).
    Line line(c);
    int wrong = 0, lost = 0;
    constexpr int kTrials = 400;
    for (int i = 0; i < kTrials; ++i) {
      line.talk.clear();
      const EmulatedMeasurement now{.distance_m = 7.77};
      std::string text =
          line.emulator->hear(line.protocol->ask(1), now) + line.emulator->stream(now);
      char& spoilt = text[random() % text.size()];
      spoilt = static_cast<char>(spoilt ^ (1U << random() % 8));
      line.device_sends(text);
      for (const double d : distances(line.talk)) wrong += std::abs(d - 7.77) > 0.006 ? 1 : 0;
      line.round(now);  // may be lost to the one before
      lost += distances(line.round(now)).empty() ? 1 : 0;
    }
    const bool checked =
        c.device == Device::kBenewake || c.device == Device::kLeuzeBps || c.device == Device::kWcs;
    EXPECT_LE(wrong, checked ? 2 : kTrials / 3) << name_of(c);
    EXPECT_EQ(lost, 0) << name_of(c);
    EXPECT_GT(line.protocol->damaged(), 0U) << name_of(c);
  }
}

TEST(DistanceProtocols, SurviveAnythingWithBoundedMemory) {
  std::mt19937 random(11);
  for (const RangefinderConfig& c : kAll) {
    Line line(c);
    std::string noise(20'000, '\0');
    for (char& b : noise) b = static_cast<char>(random());
    line.device_sends(noise);
    line.device_sends(std::string(5000, '7'));
    line.device_sends(std::string(5000, '\x02'));
    for (const double d : distances(line.talk)) EXPECT_TRUE(std::isfinite(d)) << name_of(c);
    line.protocol->forget();
    line.round({.distance_m = 3});  // may still be part of the noise
    EXPECT_EQ(distances(line.round({.distance_m = 3})).size(), 1U) << name_of(c);
  }
}

TEST(DistanceProtocols, AHeartbeatThatStandsStillIsAFault) {
  Line line(config_of(Device::kTelegram));
  for (int i = 0; i < 9; ++i) line.round({.distance_m = 4, .broken = true});
  EXPECT_EQ(distances(line.round({.distance_m = 4, .broken = true})).size(), 1U);
  EXPECT_TRUE(says(line.round({.distance_m = 4, .broken = true}), Kind::kFault));
  EXPECT_EQ(distances(line.round({.distance_m = 4})).size(), 1U);
}

TEST(DistanceProtocols, AnAnswerInPiecesIsOneAndWhatComesUnaskedIsNone) {
  Line line(config_of(Device::kLeuzeBps, true));
  const EmulatedMeasurement now{.distance_m = 0};
  const std::string answer = line.emulator->hear(line.protocol->ask(0), now);
  for (const char byte : answer) line.device_sends({byte});
  line.device_sends(answer + answer);
  EXPECT_EQ(distances(line.talk), std::vector<double>{0.0});
  EXPECT_EQ(line.protocol->damaged(), 12U);
}

TEST(DistanceProtocols, AWcsHeadHearsItsOwnQuestionOnTwoWiresAndSaysHowItIsOffTheRail) {
  Line line(config_of(Device::kWcs, true));
  const auto read = [&line](const std::string& text) {
    line.talk.clear();
    line.device_sends(line.protocol->ask(0) + text);
    return line.talk;
  };
  // 19 bits: 0b10000 0000001 0000011 = 262'275.
  EXPECT_EQ(distances(read({0, 0x10, 1, 3, 0x12})), std::vector<double>{262.275});
  EXPECT_EQ(read({2, 0, 0, 0, 2}).at(0).text, "read head is partly off the code rail");
  EXPECT_EQ(read({2, 0, 0, 1, 3}).at(0).text, "read head is off the code rail");
  EXPECT_EQ(read({5, 0, 0, 7, 2}).at(0).text, "read head reports error 7");
  EXPECT_EQ(line.protocol->damaged(), 0U);
  EXPECT_TRUE(read({0, 0x10, 1, 3, 0x13}).empty()) << "its check does not fit";
  EXPECT_TRUE(read({0x10, 0, 0, 0, 0x10}).empty()) << "another head answers";
  EXPECT_EQ(line.protocol->damaged(), 2U);
}

TEST(DistanceProtocols, SicksOtherTelegramsOfTheManual) {
  Line line(config_of(Device::kSickDl100));
  const auto read = [&line](const std::string& text) {
    line.talk.clear();
    line.device_sends(text);
    return line.talk;
  };
  EXPECT_NEAR(distances(read("\x02"
                             "8124+0012345+00012\x03"))
                  .at(0),
              1.2345, 1e-9);
  EXPECT_NEAR(distances(read("+0012345\r\n")).at(0), 1.2345, 1e-9);
  EXPECT_TRUE(says(read("\x02"
                        "8122+0999999\x03"),
                   Kind::kNoDistance));
  EXPECT_TRUE(says(read("\x02"
                        "8121+0012345+00004\x03"),
                   Kind::kWarning));  // contamination
  EXPECT_TRUE(says(read("\x02"
                        "81250040\x03"),
                   Kind::kFault));  // contamination, error
  EXPECT_TRUE(distances(read("\x02"
                             "8122+0012345\x03"))
                  .empty());
  EXPECT_EQ(line.protocol->damaged(), 0U);
  EXPECT_TRUE(read("\x02"
                   "8122+001234\x03")
                  .empty());  // a digit is missing
  EXPECT_EQ(line.protocol->damaged(), 1U);
  Line dt(config_of(Device::kSickDt1000, true));
  dt.device_sends("\x02sRA Distance FFFFF830\x03");
  EXPECT_NEAR(distances(dt.talk).at(0), -2.0, 1e-9);
}

// ------------------------------------------------------------------ Devices that come and go.

/// A source whose every answer is written down beforehand.
class Scripted final : public DistanceSource {
 public:
  Result<void> open() override {
    ++opened;
    if (opened <= refused) return Error{ErrorCode::kResource, "/dev/x", "no permission", "dialout"};
    return {};
  }
  Result<void> listen(std::chrono::milliseconds limit, DeviceTalk& out) override {
    if (script.empty()) {
      std::this_thread::sleep_for(limit);
      return {};
    }
    const auto next = script.front();
    script.pop_front();
    if (!next) return Error{ErrorCode::kResource, "/dev/x", "was unplugged or closed", ""};
    out.push_back(*next);
    return {};
  }
  void close() override { ++closed; }
  [[nodiscard]] std::uint64_t damaged() const override { return 0; }
  int opened = 0, closed = 0, refused = 0;
  std::deque<std::optional<DeviceSaid>> script;  ///< nothing: it is unplugged
};

struct Followed {
  std::vector<DistanceReading> readings;
  std::vector<DeviceState> states;
};

/// Until `enough` readings, 10 s at most.
Followed follow(std::unique_ptr<DistanceSource> source, RangefinderConfig c, std::size_t enough) {
  Followed out;
  SystemClock clock;
  DistanceDevice device({std::move(c)}, std::move(source), clock);
  std::stop_source stop;
  const auto begin = std::chrono::steady_clock::now();
  device.follow(
      stop.get_token(),
      [&](const DistanceReading& reading) {
        out.readings.push_back(reading);
        if (out.readings.size() >= enough || std::chrono::steady_clock::now() - begin > 10s)
          stop.request_stop();
      },
      [&](const DeviceState& state) { out.states.push_back(state); });
  return out;
}

TEST(DistanceDevice, ConnectsAgainAfterRefusalAndUnplugging) {
  auto source = std::make_unique<Scripted>();
  source->refused = 2;
  source->script = {DeviceSaid{Kind::kDistance, 4.5, "", 0}, std::nullopt,
                    DeviceSaid{Kind::kDistance, 4.6, "", 0}};
  const Followed f = follow(std::move(source), config_of(Device::kDimetix), 5);
  ASSERT_EQ(f.readings.size(), 5U);
  EXPECT_FALSE(f.readings[0].good);
  EXPECT_EQ(f.readings[0].why, Cause::kDeviceSilent);
  EXPECT_TRUE(f.readings[2].good);
  EXPECT_FALSE(f.readings[3].good);
  EXPECT_TRUE(f.readings[4].good);
  EXPECT_NEAR(f.readings[4].distance_m, 4.6, 1e-12);
  EXPECT_NE(f.states.front().text.find("no permission"), std::string::npos);
}

TEST(DistanceDevice, SilenceAndReadingsOutsideItsRangeAreFailures) {
  RangefinderConfig c = config_of(Device::kDimetix);
  c.silence_ms = 60;
  c.max_m = 10;
  auto source = std::make_unique<Scripted>();
  source->script = {DeviceSaid{Kind::kDistance, 11, "", 0}, DeviceSaid{Kind::kDistance, 9, "", 0}};
  const Followed f = follow(std::move(source), c, 3);
  ASSERT_EQ(f.readings.size(), 3U);
  EXPECT_EQ(f.readings[0].why, Cause::kBeyondDeviceRange);
  EXPECT_TRUE(f.readings[1].good);
  EXPECT_EQ(f.readings[2].why, Cause::kDeviceSilent);
}

/// A device at the end of a pseudo-terminal.
class Terminal {
 public:
  Terminal() : fd_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
    grantpt(fd_);
    unlockpt(fd_);
    name_ = ptsname(fd_);
  }
  ~Terminal() { unplug(); }
  [[nodiscard]] const std::string& name() const { return name_; }
  void send(const std::string& text) const {
    [[maybe_unused]] const auto n = write(fd_, text.data(), text.size());
  }
  void unplug() {
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
  }

 private:
  int fd_;
  std::string name_;
};

TEST(ByteLink, ReadsASerialLineUntilItIsUnpluggedAndSharesItWithNobody) {
  Terminal terminal;
  auto link = ByteLink::open(terminal.name(), {19'200, 'N', 8});
  ASSERT_TRUE(link.ok()) << link.error().text();
  EXPECT_EQ(link->line_time_ns(16), 16LL * 10 * 1'000'000'000 / 19'200);
  terminal.send("g0h+00012345\r\n");
  std::array<std::uint8_t, 64> bytes{};
  const auto got = link->read(bytes, 1000ms);
  ASSERT_TRUE(got.ok());
  EXPECT_EQ(*got, 14U);
  const auto second = ByteLink::open(terminal.name(), {19'200, 'N', 8});
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().text().find("in use by another program"), std::string::npos);
  terminal.unplug();
  const auto gone = link->read(bytes, 1000ms);
  ASSERT_FALSE(gone.ok());
  EXPECT_NE(gone.error().text().find("unplugged"), std::string::npos);
}

TEST(ByteLink, SaysWhatIsWrongAndWhatToDo) {
  const auto text = [](const std::string& port, int baud = 9600) {
    const auto link = ByteLink::open(port, {baud, 'N', 8});
    return link.ok() ? std::string("opened") : link.error().text();
  };
  EXPECT_NE(text("/dev/no-such-device").find("plugged in"), std::string::npos);
  EXPECT_NE(text("/dev/null").find("no serial line"), std::string::npos);
  EXPECT_NE(text("/dev/null", 12'345).find("baud"), std::string::npos);
  EXPECT_NE(text("tcp://127.0.0.1:1").find("refused"), std::string::npos);
  EXPECT_NE(text("tcp://127.0.0.1").find("port"), std::string::npos);
}

TEST(RangefinderConfig, ReadsBackAsItIsAndSaysEveryProblem) {
  const char* good = R"(
rangefinders:
  - {axis: cart, device: sick-dl100, port: /dev/ttyUSB0, baud: 19200, parity: even, mode: poll}
  - axis: trolley
    device: telegram
    port: udp://192.168.0.2:2000
    unit_m: 0.001
    telegram: {length: 16, value_offset: 8, heartbeat_offset: 0, value_type: float32}
)";
  const auto site = parse_site_config(good, "good");
  ASSERT_TRUE(site.ok()) << site.error().text();
  ASSERT_EQ(site->rangefinders.size(), 2U);
  const auto again = parse_site_config(to_yaml(*site), "again");
  ASSERT_TRUE(again.ok()) << again.error().text();
  EXPECT_EQ(to_yaml(*again), to_yaml(*site));
  for (const auto& [bad, what] : std::vector<std::pair<std::string, std::string>>{
           {"{axis: cart, device: text, port: /dev/a}", "unit_m"},
           {"{axis: cart, device: nonsense, port: /dev/a}", "none of"},
           {"{device: dimetix, port: /dev/a}", "axis"},
           {"{axis: cart, device: dimetix, port: COM3}", "/dev/ttyUSB0"},
           {"{axis: cart, device: dimetix, port: \"tcp://plc\"}", "port number"},
           {"{axis: cart, device: modbus, unit_m: 0.001, port: /dev/a}", "tcp://"},
           {"{axis: cart, device: telegram, unit_m: 0.001, port: \"udp://a:1\", telegram: {length: "
            "4, "
            "value_offset: 2}}",
            "beyond the end"},
           {"{axis: cart, device: dimetix, port: /dev/a}\n  - {axis: cart, device: dimetix, port: "
            "/dev/b}",
            "another rangefinder"}}) {
    const auto refused = parse_site_config("rangefinders:\n  - " + bad + "\n", "bad");
    ASSERT_FALSE(refused.ok()) << bad;
    EXPECT_NE(refused.error().text().find(what), std::string::npos) << refused.error().text();
  }
}

}  // namespace
}  // namespace crane
