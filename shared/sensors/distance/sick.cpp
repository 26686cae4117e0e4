// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/sick.hpp"

#include <array>
#include <cstdlib>

namespace crane {
namespace {

constexpr std::size_t kDigits = 7;
constexpr long kSaturated = 999'999;  ///< DL100: nothing farther is said

std::string stx(const std::string& text) {
  return "\x02" + text + "\x03";
}

/// Bits of the DL100's status, warnings and errors alike.
constexpr std::array<const char*, 4> kParts = {"laser", "temperature", "contamination",
                                               "plausibility"};

std::string named(std::uint32_t bits) {
  std::string out;
  for (std::size_t i = 0; i < kParts.size(); ++i)
    if ((bits >> i & 1U) != 0) out += (out.empty() ? "" : ", ") + std::string(kParts[i]);
  return out;
}

}  // namespace

SerialLine SickProtocol::line() const {
  return {model_ == Model::kDl100 ? 38'400 : 115'200, 'N', 8};
}

std::string SickProtocol::begin() const {
  if (polled_) return {};
  return stx(model_ == Model::kDl100 ? "052201" : "050201");
}

std::string SickProtocol::end() const {
  if (polled_) return {};
  return stx(model_ == Model::kDl100 ? "052200" : "050200");
}

std::string SickProtocol::ask(std::uint64_t n) {
  constexpr std::uint64_t kHealthEvery = 20;
  std::string out;
  if (polled_)
    out = model_ == Model::kDl100  ? stx("0122")
          : model_ == Model::kDl50 ? stx("0107")
                                   : stx("sRN Distance");
  if (polled_ && n % kHealthEvery != 0) return out;
  if (model_ == Model::kDl100) {
    static const std::array<std::string, 3> kHealth = {stx("0125"), stx("0123"), stx("0126")};
    const std::uint64_t round = polled_ ? n / kHealthEvery : n;
    out += kHealth[round % 4 == 1 ? 1 : round % 4 == 3 ? 2 : 0];
  } else if (model_ == Model::kDl50) {
    out += stx("0105");
  } else {
    out += stx("sRN RSSI");
  }
  return out;
}

void SickProtocol::take(std::span<const std::uint8_t> bytes, DeviceTalk& out) {
  for (const std::uint8_t byte : bytes) {
    const auto frame = frames_.take(byte, damaged_);
    if (frame && !understand(*frame, out)) ++damaged_;
  }
}

void SickProtocol::forget() {
  frames_.forget();
  fault_.clear();
}

void SickProtocol::measured(long counts, std::size_t bytes, DeviceTalk& out) {
  using Kind = DeviceSaid::Kind;
  if (!fault_.empty())
    out.push_back({Kind::kFault, 0, fault_, bytes});
  else if (counts == 0)
    out.push_back({Kind::kNoDistance, 0, "reads 0: no target", bytes});
  else if (model_ != Model::kDt1000 && std::labs(counts) >= kSaturated)
    out.push_back({Kind::kNoDistance, 0, "reads its largest value: out of range", bytes});
  else
    out.push_back({Kind::kDistance, double(counts) * unit_m_, "", bytes});
}

bool SickProtocol::distance(std::string_view digits, std::size_t bytes, DeviceTalk& out) {
  const auto counts = signed_digits(digits, kDigits);
  if (!counts) return false;
  measured(*counts, bytes, out);
  return true;
}

void SickProtocol::status(std::uint32_t errors, std::uint32_t warnings, DeviceTalk& out) {
  using Kind = DeviceSaid::Kind;
  fault_ = errors != 0 ? "device reports an error: " + named(errors) : "";
  if (errors != 0)
    out.push_back({Kind::kFault, 0, fault_, 0});
  else if (warnings != 0)
    out.push_back({Kind::kWarning, 0, "device warns: " + named(warnings), 0});
  else
    out.push_back({Kind::kWell});
}

bool SickProtocol::understand(const TextFrames::Frame& frame, DeviceTalk& out) {
  const std::string_view text = frame.text;
  if (frame.framing == TextFrames::Framing::kLine) return distance(text, frame.bytes, out);
  const auto after = [&](std::string_view start) -> std::optional<std::string_view> {
    if (!text.starts_with(start)) return std::nullopt;
    return text.substr(start.size());
  };
  if (model_ == Model::kDt1000) {
    if (const auto hex = after("sRA Distance ")) {
      const auto counts = hex32(*hex);
      if (counts) measured(*counts, frame.bytes, out);
      return counts.has_value();
    }
    if (const auto hex = after("sRA RSSI ")) {
      const auto level = hex32(*hex);
      if (level) out.push_back({DeviceSaid::Kind::kFigure, double(*level), "level", 0});
      return level.has_value();
    }
    if (text.starts_with("sFA")) return true;  // an error of ours: it does not know the question
  }
  if (text.size() < 4) return false;
  const std::string_view code = text.substr(0, 4);
  const std::string_view rest = text.substr(4);
  constexpr std::size_t kValue = 8, kSpeed = 6;  // with sign
  // Of the DT1000's stream, beside the distance: status as 8 hexadecimal digits.
  if (model_ == Model::kDt1000 && code == "0321") {
    if (rest.size() != kValue + 9 || rest[kValue] != '_') return false;
    const auto word = hex32(rest.substr(kValue + 1));
    if (!word) return false;
    const auto bits = static_cast<std::uint32_t>(*word);
    constexpr std::uint32_t kErrors = 0xF8000000U, kWarnings = 0x00F80000U, kNoEcho = 0x1800U;
    fault_ = (bits & kErrors) != 0
                 ? "device reports an error, status " + std::string(rest.substr(kValue + 1))
                 : "";
    if ((bits & kWarnings) != 0)
      out.push_back({DeviceSaid::Kind::kWarning, 0,
                     "device warns, status " + std::string(rest.substr(kValue + 1)), 0});
    if ((bits & kNoEcho) != 0) {
      out.push_back({DeviceSaid::Kind::kNoDistance, 0, "no echo", frame.bytes});
      return true;
    }
    return distance(rest.substr(0, kValue), frame.bytes, out);
  }
  if (model_ == Model::kDt1000 && code == "0323") {
    if (rest.size() != kValue + 6 || rest[kValue] != '_') return false;
    return distance(rest.substr(0, kValue), frame.bytes, out);
  }
  const bool dl50 = model_ == Model::kDl50;
  if (dl50 ? code == "8107" || code == "0302" : code == "8122" || code == "0322")
    return distance(rest, frame.bytes, out);
  if (!dl50 && (code == "8124" || code == "0324"))
    return rest.size() == kValue + kSpeed && distance(rest.substr(0, kValue), frame.bytes, out);
  if (model_ == Model::kDl100 && (code == "8121" || code == "0321")) {
    const auto word =
        rest.size() == kValue + kSpeed ? signed_digits(rest.substr(kValue), 5) : std::nullopt;
    if (!word || *word < 0) return false;
    status(static_cast<std::uint32_t>(*word) >> 4U & 15U, static_cast<std::uint32_t>(*word) & 15U,
           out);
    return distance(rest.substr(0, kValue), frame.bytes, out);
  }
  if (model_ == Model::kDl100 && code == "8125") {
    const auto word = rest.size() == 4 ? hex32(rest) : std::nullopt;
    if (!word) return false;
    status(static_cast<std::uint32_t>(*word) >> 4U & 15U, static_cast<std::uint32_t>(*word) & 15U,
           out);
    return true;
  }
  if (dl50 ? code == "8105" : code == "8123" || code == "8126") {
    for (const std::size_t digits : {1U, 2U, 3U})  // the manual's examples have fewer than it says
      if (const auto value = signed_digits(rest, digits)) {
        out.push_back({DeviceSaid::Kind::kFigure, double(*value),
                       code == "8126" ? "temperature_c" : "level_db", 0});
        return true;
      }
    return false;
  }
  return code == "8522" || code == "8502";  // "goes on", "stops": what begin() and end() asked for
}

}  // namespace crane
