// SPDX-License-Identifier: Apache-2.0
// Rangefinders on pseudo-terminals, through the real drivers, services and DDS, into the map.

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <list>

#include "base/clock.hpp"
#include "dds/endpoints.hpp"
#include "dds/participant.hpp"
#include "process.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;

class RangefinderLive : public ::testing::Test {
 protected:
  RangefinderLive() {
    std::ofstream(site()) << "dds: {domain: " << domain_ << "}\n"
                          << "http: {port: 0}\n"
                          << "rangefinders:\n"
                          << "  - {axis: cart, device: dimetix, port: " << port("cart")
                          << ", max_m: 30}\n"
                          << "  - {axis: trolley, device: sick-dl100, port: " << port("trolley")
                          << "}\n";
  }
  [[nodiscard]] std::string site() const { return folder_ / "site.yaml"; }
  [[nodiscard]] std::string port(const std::string& axis) const {
    return folder_ / (axis + "-line");
  }

  Process& start(const std::string& name, std::vector<std::string> command) {
    return processes_.emplace_back(std::move(command), folder_ / (name + ".txt"));
  }
  Process& emulate(const std::string& axis, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"cranemap", "emulate", "--config", site(), "--axis", axis});
    return start("emulate-" + axis, std::move(more));
  }
  Process& rangefinder() {
    return start("rangefinder", {"cranemap-rangefinder", "--config", site()});
  }

  TempFolder folder_;
  std::string domain_ = next_domain();
  std::list<Process> processes_;
};

/// What arrives on rangefinder_position.
class Positions {
 public:
  explicit Positions(const std::string& domain) {
    dds::Settings settings;
    settings.domain = static_cast<std::uint32_t>(std::stoi(domain));
    participant_ = *dds::Participant::create(settings, "test");
    reader_.emplace(*dds::Reader<dds::RangefinderPositionTopic>::create(participant_, nullptr));
  }
  /// Of an axis, once one that is `good` or not arrives; nothing after 20 s.
  std::optional<v1::RangefinderPosition> next(std::uint32_t axis, bool good) {
    std::optional<v1::RangefinderPosition> found;
    eventually(20s, [&] {
      while (auto sample = reader_->take())
        if ((*sample)->axis() == axis && ((*sample)->device_status() == v1::STATUS_OK) == good)
          found = **sample;
      return found.has_value();
    });
    return found;
  }

 private:
  std::shared_ptr<dds::Participant> participant_;
  std::optional<dds::Reader<dds::RangefinderPositionTopic>> reader_;
};

TEST_F(RangefinderLive, ReadsTwoDevicesAndSaysWhatAilsThemUntilTheyAreWellAgain) {
  Positions positions(domain_);
  Process& service = rangefinder();  // before there are devices
  EXPECT_TRUE(eventually(20s, [&] {
    return service.output().find("no such device -> is it plugged in?") != std::string::npos;
  })) << service.output();
  Process& cart = emulate("cart", {"--from", "3", "--to", "9"});
  emulate("trolley", {"--from", "1.5", "--to", "1.5"});
  const auto first = positions.next(v1::AXIS_CART, true);
  ASSERT_TRUE(first) << service.output();
  EXPECT_GE(first->distance_m(), 3 - 1e-3);
  EXPECT_LE(first->distance_m(), 9 + 1e-3);
  EXPECT_LT(std::abs(double(SystemClock().now() - first->time_ns())), 20e9);
  const auto other = positions.next(v1::AXIS_TROLLEY, true);
  ASSERT_TRUE(other);
  EXPECT_NEAR(other->distance_m(), 1.5, 1e-3);
  // Unplugged: said, as a failed reading and in words. Plugged in again: it measures.
  cart.signal(SIGTERM);
  cart.wait(10);
  ASSERT_TRUE(positions.next(v1::AXIS_CART, false));
  EXPECT_TRUE(positions.next(v1::AXIS_TROLLEY, true)) << "the other goes on";
  emulate("cart", {"--from", "4", "--to", "4", "--fault", "zero", "--every", "3", "--lasts", "1"});
  const auto again = positions.next(v1::AXIS_CART, true);
  ASSERT_TRUE(again) << service.output();
  EXPECT_NEAR(again->distance_m(), 4, 1e-3);
  EXPECT_TRUE(eventually(20s, [&] {
    return service.output().find("E255: signal too weak") != std::string::npos;
  })) << service.output();
  EXPECT_TRUE(positions.next(v1::AXIS_CART, true));
  service.signal(SIGTERM);
  EXPECT_EQ(service.wait(10), 0) << service.output();
}

TEST_F(RangefinderLive, TheMapIsMadeFromThem) {
  const std::string start_at = std::to_string(SystemClock().now() + 2 * kNsPerSecond);
  for (const char* axis : {"cart", "trolley"})
    emulate(axis, {"--recording", rig_recording(), "--start-at", start_at});
  rangefinder();
  start("mapper", {"cranemap-mapper", "--config", site(), "--calibration", rig_recording()});
  start("stereo", {"cranemap-stereo", "--config", site(), "--calibration", rig_recording()});
  start("camera",
        {"cranemap-camera", rig_recording(), "--config", site(), "--loop", "--start-at", start_at});
  std::string said;
  EXPECT_TRUE(eventually(60s, [&] {
    said = run({"status", "--config", site(), "--frames", "6"}, folder_.path(), 20).output;
    return said.find("valid: true") != std::string::npos &&
           said.find("frames_integrated: 0") == std::string::npos;
  })) << said;
  EXPECT_NE(said.find("frames_rejected: 0\n"), std::string::npos) << said;
}

TEST_F(RangefinderLive, DoctorAsksThem) {
  emulate("cart", {"--from", "3", "--to", "3"});
  const auto doctor = [this] {
    return run({"doctor", "--config", site(), "--seconds", "0"}, folder_.path(), 60);
  };
  Finished said = doctor();
  EXPECT_TRUE(eventually(20s, [&] {
    said = doctor();
    return said.output.find("dimetix measures 3.0000 m") != std::string::npos;
  })) << said.output;
  EXPECT_NE(said.output.find("trolley-line: no such device"), std::string::npos) << said.output;
  EXPECT_EQ(said.code, 3);
}

TEST_F(RangefinderLive, DoctorSaysThatADeviceIsInUseOrMayNotBeOpened) {
  emulate("cart", {"--from", "3", "--to", "3"});
  emulate("trolley", {"--from", "1", "--to", "1"});
  rangefinder();
  Finished said;
  EXPECT_TRUE(eventually(30s, [&] {
    said = run({"doctor", "--config", site(), "--seconds", "0"}, folder_.path(), 60);
    return said.output.find("cart-line: in use by another program") != std::string::npos &&
           said.output.find("trolley-line: in use by another program") != std::string::npos;
  })) << said.output;
  EXPECT_NE(said.output.find("a service follows it already"), std::string::npos) << said.output;
  // As somebody whom a terminal does not belong to.
  const std::string setpriv = "/usr/bin/setpriv";
  if (geteuid() != 0 || access(setpriv.c_str(), X_OK) != 0) return;
  std::filesystem::permissions(folder_.path(), std::filesystem::perms(0755));
  Process& nobody = start("nobody", {setpriv, "--reuid=65534", "--regid=65534", "--clear-groups",
                                     std::string(CRANEMAP_BIN_DIR) + "/cranemap", "doctor",
                                     "--config", site(), "--seconds", "0"});
  nobody.wait(60);
  EXPECT_NE(nobody.output().find("cart-line: no permission"), std::string::npos) << nobody.output();
  EXPECT_NE(nobody.output().find("group dialout"), std::string::npos) << nobody.output();
}

TEST_F(RangefinderLive, RegistersOfAPlcAreReadAndItsHeartbeatIsHeard) {
  // A port that other runs on this machine hardly use.
  const std::string port = "tcp://127.0.0.1:" + std::to_string(20'000 + getpid() % 12'000);
  std::ofstream(site()) << "dds: {domain: " << domain_ << "}\n"
                        << "http: {port: 0}\n"
                        << "rangefinders:\n"
                        << "  - {axis: cart, device: modbus, port: '" << port << "', unit_m: 0.001,"
                        << " modbus: {value_register: 100, value_type: float32, unit: 3,"
                        << " low_word_first: true, heartbeat_register: 7}}\n";
  Positions positions(domain_);
  emulate("cart",
          {"--from", "7.25", "--to", "7.25", "--fault", "broken", "--every", "6", "--lasts", "3"});
  Process& service = rangefinder();
  const auto first = positions.next(v1::AXIS_CART, true);
  ASSERT_TRUE(first) << service.output();
  EXPECT_NEAR(first->distance_m(), 7.25, 1e-5);
  EXPECT_TRUE(positions.next(v1::AXIS_CART, false)) << service.output();
  EXPECT_TRUE(eventually(20s, [&] {
    return service.output().find("the PLC's heartbeat stands still") != std::string::npos;
  })) << service.output();
  EXPECT_TRUE(positions.next(v1::AXIS_CART, true)) << service.output();
}

TEST(Emulate, SaysWhatItIsMissing) {
  TempFolder folder;
  EXPECT_EQ(run({"emulate"}, folder.path()).code, 2);
  EXPECT_EQ(run({"emulate", "dimetix"}, folder.path()).code, 2);
  const Finished no_unit = run({"emulate", "text", "--port", folder / "x"}, folder.path());
  EXPECT_EQ(no_unit.code, 2);
  EXPECT_NE(no_unit.output.find("unit_m"), std::string::npos) << no_unit.output;
  EXPECT_EQ(
      run({"emulate", "dimetix", "--port", "/no/such/folder/x", "--for", "1"}, folder.path()).code,
      3);
}

}  // namespace
}  // namespace crane::test
