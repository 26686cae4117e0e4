// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/emulators.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace crane {
namespace {

using Device = RangefinderConfig::Device;

std::string format(const char* pattern, long value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), pattern, value);
  return text.data();
}

long counts(double metres, double unit_m) {
  return std::lround(metres / unit_m);
}

/// Commands between a start and an end, cut out of what arrives.
class Commands {
 public:
  explicit Commands(char end) : end_(end) {}
  template <class Answer>
  std::string each(std::string_view bytes, Answer answer) {
    std::string out;
    for (const char c : bytes) {
      if (c == end_) {
        out += answer(text_);
        text_.clear();
      } else if (c == '\x02') {
        text_.clear();
      } else if (c != '\r' && c != '\n' && text_.size() < 64) {
        text_ += c;
      }
    }
    return out;
  }

 private:
  char end_;
  std::string text_;
};

class SickEmulator final : public DistanceEmulator {
 public:
  SickEmulator(Device device, double unit_m) : device_(device), unit_m_(unit_m) {}

  std::string hear(std::string_view bytes, const EmulatedMeasurement& now) override {
    return commands_.each(bytes, [&](const std::string& text) { return answer(text, now); });
  }
  std::string stream(const EmulatedMeasurement& now) override {
    if (!streaming_) return {};
    return framed((device_ == Device::kSickDl50 ? "0302" : "0322") + digits(now));
  }

 private:
  static std::string framed(const std::string& text) { return "\x02" + text + "\x03"; }
  [[nodiscard]] std::string digits(const EmulatedMeasurement& now) const {
    return format("%+08ld", now.no_target ? 0 : counts(now.distance_m, unit_m_));
  }
  std::string answer(const std::string& text, const EmulatedMeasurement& now) {
    if (device_ == Device::kSickDt1000) {
      if (text == "sRN Distance")
        return framed("sRA Distance " +
                      format("%lX", now.no_target ? 0 : counts(now.distance_m, unit_m_)));
      if (text == "sRN RSSI") return framed("sRA RSSI 1F4");
      return framed("sFA 3");
    }
    const bool dl100 = device_ == Device::kSickDl100;
    if (text == (dl100 ? "0122" : "0107")) return framed((dl100 ? "8122" : "8107") + digits(now));
    if (text == (dl100 ? "052201" : "050201")) {
      streaming_ = true;
      return framed("8" + text.substr(1));
    }
    if (text == (dl100 ? "052200" : "050200")) {
      streaming_ = false;
      return framed("8" + text.substr(1));
    }
    if (!dl100) return text == "0105" ? framed("8105-42") : "";
    // Bit 2: contamination as warning; bit 4: laser as error; bit 10: laser on.
    if (text == "0125")
      return framed("8125" + format("%04lX", 0x400 | (now.dirty ? 4 : 0) | (now.broken ? 16 : 0)));
    if (text == "0123") return framed(now.dirty ? "8123-71" : "8123-39");
    if (text == "0126") return framed("8126+31");
    return {};
  }
  Device device_;
  double unit_m_;
  bool streaming_ = false;
  Commands commands_{'\x03'};
};

class DimetixEmulator final : public DistanceEmulator {
 public:
  explicit DimetixEmulator(double unit_m) : unit_m_(unit_m) {}

  std::string hear(std::string_view bytes, const EmulatedMeasurement& now) override {
    return commands_.each(bytes, [&](const std::string& text) -> std::string {
      if (text == "s0c") {
        streaming_ = false;
        return "g0?\r\n";
      }
      if (text == "s0h") {
        streaming_ = true;
        return {};
      }
      return text == "s0g" ? line('g', now) : "g0@E203\r\n";
    });
  }
  std::string stream(const EmulatedMeasurement& now) override {
    return streaming_ ? line('h', now) : "";
  }

 private:
  [[nodiscard]] std::string line(char kind, const EmulatedMeasurement& now) const {
    if (now.broken) return "g0@E272\r\n";
    if (now.no_target) return "g0@E255\r\n";
    return std::string("g0") + kind + format("%+09ld", counts(now.distance_m, unit_m_)) + "\r\n";
  }
  double unit_m_;
  bool streaming_ = false;
  Commands commands_{'\n'};
};

class BenewakeEmulator final : public DistanceEmulator {
 public:
  explicit BenewakeEmulator(double unit_m) : unit_m_(unit_m) {}

  std::string hear(std::string_view /*bytes*/, const EmulatedMeasurement& /*now*/) override {
    return {};
  }
  std::string stream(const EmulatedMeasurement& now) override {
    const auto distance = static_cast<std::uint16_t>(counts(now.distance_m, unit_m_));
    const std::uint16_t strength = now.no_target ? 37 : 1450;
    constexpr std::uint16_t kTemperature = 8 * (256 + 29);
    std::string out = "\x59\x59";
    for (const std::uint16_t word : {distance, strength, kTemperature}) {
      out += static_cast<char>(word & 0xFFU);
      out += static_cast<char>(word >> 8U);
    }
    unsigned sum = 0;
    for (const char c : out) sum += static_cast<unsigned char>(c);
    return out + static_cast<char>(sum & 0xFFU);
  }

 private:
  double unit_m_;
};

class LeuzeEmulator final : public DistanceEmulator {
 public:
  explicit LeuzeEmulator(double unit_m) : unit_m_(unit_m) {}

  std::string hear(std::string_view bytes, const EmulatedMeasurement& now) override {
    std::string out;
    for (const char c : bytes) {
      command_ = (command_ << 8U | static_cast<unsigned char>(c)) & 0xFF'FFFFU;
      if (command_ == 0xC0F131) out += telegram(now);
      if (command_ == 0xC0F232) streaming_ = true;
      if (command_ == 0xC0F333) streaming_ = false;
    }
    return out;
  }
  std::string stream(const EmulatedMeasurement& now) override {
    return streaming_ ? telegram(now) : "";
  }

 private:
  [[nodiscard]] std::string telegram(const EmulatedMeasurement& now) const {
    const auto position = static_cast<std::uint32_t>(counts(now.distance_m, unit_m_));
    std::string out(1, static_cast<char>((now.broken ? 1 : 0) | (now.no_target ? 2 : 0) |
                                         (now.dirty ? 0x60 : 0)));
    for (int shift = 24; shift >= 0; shift -= 8)
      out += static_cast<char>(position >> shift & 0xFFU);
    char check = 0;
    for (const char c : out) check = static_cast<char>(check ^ c);
    return out + check;
  }
  double unit_m_;
  bool streaming_ = false;
  std::uint32_t command_ = 0;
};

class WcsEmulator final : public DistanceEmulator {
 public:
  explicit WcsEmulator(double unit_m) : unit_m_(unit_m) {}

  std::string hear(std::string_view bytes, const EmulatedMeasurement& now) override {
    std::string out;
    for (const char c : bytes)
      if (static_cast<unsigned char>(c) == 0x80) out += telegram(now);  // read head 0
    return out;
  }
  std::string stream(const EmulatedMeasurement& /*now*/) override { return {}; }

 private:
  [[nodiscard]] std::string telegram(const EmulatedMeasurement& now) const {
    // Off the rail it says 1; with an error, its number.
    const long p = now.broken ? 5 : now.no_target ? 1 : counts(now.distance_m, unit_m_);
    std::string out = {
        static_cast<char>((now.dirty ? 4 : 0) | (now.no_target ? 2 : 0) | (now.broken ? 1 : 0)),
        static_cast<char>(p >> 14 & 0x1F), static_cast<char>(p >> 7 & 0x7F),
        static_cast<char>(p & 0x7F)};
    return out + static_cast<char>(out[0] ^ out[1] ^ out[2] ^ out[3]);
  }
  double unit_m_;
};

class TextEmulator final : public DistanceEmulator {
 public:
  explicit TextEmulator(const RangefinderConfig& c)
      : asked_(!c.question.empty()), unit_m_(c.unit_m) {}

  std::string hear(std::string_view bytes, const EmulatedMeasurement& now) override {
    return asked_ && !bytes.empty() ? line(now) : "";
  }
  std::string stream(const EmulatedMeasurement& now) override { return asked_ ? "" : line(now); }

 private:
  [[nodiscard]] std::string line(const EmulatedMeasurement& now) const {
    std::array<char, 48> text{};
    std::snprintf(text.data(), text.size(), "D=%.4f\r\n",
                  now.no_target ? 9999.9999 : now.distance_m / unit_m_);
    return text.data();
  }
  bool asked_;
  double unit_m_;
};

class TelegramEmulator final : public DistanceEmulator {
 public:
  explicit TelegramEmulator(const RangefinderConfig& c) : c_(c.telegram), unit_m_(c.unit_m) {}

  std::string hear(std::string_view /*bytes*/, const EmulatedMeasurement& /*now*/) override {
    return {};
  }
  std::string stream(const EmulatedMeasurement& now) override {
    std::string out(static_cast<std::size_t>(c_.length), '\0');
    if (!now.broken) ++beat_;
    put(out, c_.value_offset, c_.value_type, now.no_target ? 0 : now.distance_m / unit_m_);
    if (c_.heartbeat_offset >= 0)
      put(out, c_.heartbeat_offset, c_.heartbeat_type, double(beat_ % 0x8000));
    return out;
  }

 private:
  void put(std::string& out, int offset, PlcNumber type, double value) const {
    const std::size_t bytes = plc_bytes(type);
    const std::uint64_t raw =
        type == PlcNumber::kFloat32   ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
        : type == PlcNumber::kFloat64 ? std::bit_cast<std::uint64_t>(value)
                                      : static_cast<std::uint64_t>(std::llround(value));
    for (std::size_t i = 0; i < bytes; ++i)
      out[static_cast<std::size_t>(offset) + i] =
          static_cast<char>(raw >> (8 * (c_.little_endian ? i : bytes - 1 - i)) & 0xFFU);
  }
  PlcTelegramConfig c_;
  double unit_m_;
  std::uint64_t beat_ = 0;
};

}  // namespace

std::unique_ptr<DistanceEmulator> make_distance_emulator(const RangefinderConfig& c) {
  const auto unit = [&c](double makers) { return c.unit_m > 0 ? c.unit_m : makers; };
  switch (c.device) {
    case Device::kSickDl100:
      return std::make_unique<SickEmulator>(c.device, unit(1e-4));
    case Device::kSickDl50:
    case Device::kSickDt1000:
      return std::make_unique<SickEmulator>(c.device, unit(1e-3));
    case Device::kDimetix:
      return std::make_unique<DimetixEmulator>(unit(1e-4));
    case Device::kBenewake:
      return std::make_unique<BenewakeEmulator>(unit(1e-2));
    case Device::kLeuzeBps:
      return std::make_unique<LeuzeEmulator>(unit(1e-3));
    case Device::kText:
      return std::make_unique<TextEmulator>(c);
    case Device::kTelegram:
      return std::make_unique<TelegramEmulator>(c);
    case Device::kWcs:
      return std::make_unique<WcsEmulator>(unit(1e-3));
    case Device::kModbus:
      break;
  }
  return nullptr;
}

}  // namespace crane
