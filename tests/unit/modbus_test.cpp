// SPDX-License-Identifier: Apache-2.0
// A PLC's registers by Modbus TCP: our source against libmodbus's server.

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <thread>

#include "sensors/distance/modbus_emulator.hpp"
#include "sensors/distance/modbus_source.hpp"

namespace crane {
namespace {

using Kind = DeviceSaid::Kind;
using namespace std::chrono_literals;

class ModbusTest : public ::testing::Test {
 protected:
  ModbusTest() {
    config_.device = RangefinderConfig::Device::kModbus;
    config_.port = "tcp://127.0.0.1:0";
    config_.unit_m = 1e-3;
    config_.interval_ms = 5;
    config_.modbus.value_register = 10;
    config_.modbus.heartbeat_register = 3;
  }
  void serve() {
    auto made = ModbusEmulator::listen(config_);
    ASSERT_TRUE(made) << made.error().text();
    source_config_ = config_;
    source_config_.port = "tcp://127.0.0.1:" + std::to_string((*made)->port());
    server_ = std::jthread([this, server = std::move(*made)](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        {
          const std::lock_guard lock(mutex_);
          server->measure(now_);
        }
        server->answer(1ms);
      }
    });
  }
  void measure(const EmulatedMeasurement& now) {
    const std::lock_guard lock(mutex_);
    now_ = now;
  }
  /// What it says next of this kind; nothing after 10 s. Error: what listening failed with.
  static Result<std::optional<DeviceSaid>> next(ModbusSource& source, Kind kind) {
    for (const auto end = std::chrono::steady_clock::now() + 10s;
         std::chrono::steady_clock::now() < end;) {
      DeviceTalk talk;
      if (auto good = source.listen(20ms, talk); !good) return good.error();
      for (const DeviceSaid& said : talk)
        if (said.kind == kind) return std::optional(said);
    }
    return std::optional<DeviceSaid>();
  }

  RangefinderConfig config_, source_config_;
  std::mutex mutex_;
  EmulatedMeasurement now_{.distance_m = 12.345};
  std::jthread server_;
};

TEST_F(ModbusTest, EveryTypeAndOrderOfWordsAndBytesIsReadAsItWasWritten) {
  for (const PlcNumber type : {PlcNumber::kInt16, PlcNumber::kUint16, PlcNumber::kInt32,
                               PlcNumber::kUint32, PlcNumber::kFloat32, PlcNumber::kFloat64})
    for (const int order : {0, 1, 2, 3}) {
      config_.modbus.type = type;
      config_.modbus.low_word_first = (order & 1) != 0;
      config_.modbus.swap_bytes = (order & 2) != 0;
      config_.modbus.input_registers = order == 3;
      serve();
      ModbusSource source(source_config_);
      ASSERT_TRUE(source.open());
      const auto said = next(source, Kind::kDistance);
      ASSERT_TRUE(said && *said) << int(type) << " " << order;
      EXPECT_NEAR((**said).value, 12.345, 1e-6) << int(type) << " " << order;
      server_ = {};
    }
}

TEST_F(ModbusTest, ANumberThatIsNoneIsNoDistanceAndAHeartbeatThatStandsStillIsAFault) {
  config_.modbus.type = PlcNumber::kFloat32;
  config_.interval_ms = 50;  // a second of it
  serve();
  ModbusSource source(source_config_);
  ASSERT_TRUE(source.open());
  measure({.distance_m = 5, .no_target = true});
  const auto none = next(source, Kind::kNoDistance);
  ASSERT_TRUE(none && *none);
  measure({.distance_m = 5, .broken = true});
  const auto fault = next(source, Kind::kFault);
  ASSERT_TRUE(fault && *fault);
  EXPECT_EQ((**fault).text, "the PLC's heartbeat stands still");
  measure({.distance_m = 5});
  const auto well = next(source, Kind::kDistance);
  ASSERT_TRUE(well && *well);
  EXPECT_NEAR((**well).value, 5, 1e-6);
}

TEST_F(ModbusTest, ARegisterThatIsNotThereIsTheConfigurationsFault) {
  serve();
  source_config_.modbus.value_register = 500;
  ModbusSource source(source_config_);
  ASSERT_TRUE(source.open());
  const auto said = next(source, Kind::kDistance);
  ASSERT_FALSE(said);
  EXPECT_EQ(said.error().code, ErrorCode::kConfiguration);
  EXPECT_NE(said.error().text().find("no register 500"), std::string::npos) << said.error().text();
}

TEST_F(ModbusTest, APlcThatIsSwitchedOffAndOnIsAnErrorAndThenReadAgain) {
  serve();
  ModbusSource source(source_config_);
  ASSERT_TRUE(source.open());
  ASSERT_TRUE(next(source, Kind::kDistance));
  server_ = {};
  const auto gone = next(source, Kind::kDistance);
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().code, ErrorCode::kResource);
  source.close();
  EXPECT_FALSE(source.open()) << "nobody listens";
  config_.port = source_config_.port;
  serve();
  ASSERT_TRUE(source.open());
  const auto again = next(source, Kind::kDistance);
  ASSERT_TRUE(again && *again);
}

}  // namespace
}  // namespace crane
