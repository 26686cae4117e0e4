// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "sensors/camera/genicam_io.hpp"

namespace crane::test {

/// A GenICam camera in the process, with what Aravis's own fake has not: chunks, PTP, a clock of
/// its own, rounding, lost packets. Outlives the device that uses it.
struct FakeGenicamCamera {
  struct Number {
    double value = 0, least = 0, most = 0;
    double step = 0;  ///< it rounds to that; 0: not
  };
  std::map<std::string, Number> numbers = {
      {"Width", {640, 16, 4096, 0}},
      {"Height", {480, 16, 4096, 0}},
      {"OffsetX", {8, 0, 4096, 0}},
      {"AcquisitionFrameRate", {30, 0.1, 200, 0}},
      {"ExposureTime", {5000, 20, 100'000, 0}},
      {"Gain", {0, 0, 24, 0}},
  };
  std::map<std::string, std::string> texts = {{"PixelFormat", "Mono8"},
                                              {"TriggerMode", "On"},
                                              {"TriggerSelector", "AcquisitionStart"},
                                              {"TriggerSource", "Line0"},
                                              {"ExposureAuto", "Continuous"}};
  std::map<std::string, bool> flags;
  std::map<std::string, std::vector<std::string>> choices = {
      {"PixelFormat", {"Mono8", "RGB8", "BayerRG8"}}};
  int open_error = 0, opens = 0, closes = 0, triggers = 0;
  bool started = false, gone = false;

  struct Shot {
    GenicamPicture facts;
    std::vector<std::uint8_t> bytes;
    std::optional<std::int64_t> chunk;
  };
  std::deque<Shot> shots;  ///< to be delivered
};

class FakeGenicam final : public GenicamIo {
 public:
  explicit FakeGenicam(FakeGenicamCamera& camera) : c_(camera) {}
  Result<void> open(const std::string& name) override {
    if (c_.gone) return Error{ErrorCode::kNotAvailable, name, "no such camera answers", ""};
    ++c_.opens;
    return {};
  }
  void close() override {
    ++c_.closes;
    c_.started = false;
  }
  bool has(const char* f) override {
    return c_.numbers.contains(f) || c_.texts.contains(f) || c_.flags.contains(f);
  }
  Result<double> number(const char* f) override {
    if (!c_.numbers.contains(f)) return unknown(f);
    return c_.numbers[f].value;
  }
  Result<Range> range(const char* f) override {
    if (!c_.numbers.contains(f)) return unknown(f);
    return Range{c_.numbers[f].least, c_.numbers[f].most};
  }
  Result<void> set_number(const char* f, double value) override {
    if (!c_.numbers.contains(f)) return unknown(f);
    auto& n = c_.numbers[f];
    n.value = n.step > 0 ? std::floor(value / n.step) * n.step : value;
    return {};
  }
  Result<std::string> text(const char* f) override {
    if (!c_.texts.contains(f)) return unknown(f);
    return c_.texts[f];
  }
  Result<void> set_text(const char* f, const std::string& value) override {
    if (!c_.texts.contains(f)) return unknown(f);
    if (const auto known = c_.choices.find(f); known != c_.choices.end())
      if (std::find(known->second.begin(), known->second.end(), value) == known->second.end())
        return Error{ErrorCode::kBadData, "cam", std::string(f) + ": " + value + " not found", ""};
    c_.texts[f] = value;
    return {};
  }
  Result<void> set_flag(const char* f, bool value) override {
    if (!c_.flags.contains(f)) return unknown(f);
    c_.flags[f] = value;
    return {};
  }
  Result<void> command(const char* f) override {
    if (std::string(f) == "TriggerSoftware") ++c_.triggers;
    return {};
  }
  Result<void> start() override {
    c_.started = true;
    return {};
  }
  std::optional<GenicamPicture> next(std::chrono::microseconds) override {
    if (c_.shots.empty()) return std::nullopt;
    held_ = std::move(c_.shots.front());
    c_.shots.pop_front();
    held_.facts.data = held_.bytes.data();
    held_.facts.bytes = held_.bytes.size();
    return held_.facts;
  }
  std::optional<std::int64_t> chunk(const char*) override { return held_.chunk; }
  bool lost() override { return c_.gone; }

 private:
  static Error unknown(const char* f) {
    return {ErrorCode::kBadData, "cam", std::string("Feature '") + f + "' not found", ""};
  }
  FakeGenicamCamera& c_;
  FakeGenicamCamera::Shot held_;
};

}  // namespace crane::test
