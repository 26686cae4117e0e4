// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/benewake.hpp"
#include "sensors/distance/dimetix.hpp"
#include "sensors/distance/leuze.hpp"
#include "sensors/distance/plc_telegram.hpp"
#include "sensors/distance/sick.hpp"
#include "sensors/distance/text_line.hpp"
#include "sensors/distance/wcs.hpp"

namespace crane {
namespace {

/// As it must be sent: the configuration writes CR and LF as \r and \n.
std::string with_escapes(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char next = i + 1 < text.size() ? text[i + 1] : '\0';
    if (text[i] == '\\' && (next == 'r' || next == 'n')) {
      out += next == 'r' ? '\r' : '\n';
      ++i;
    } else {
      out += text[i];
    }
  }
  return out;
}

}  // namespace

std::unique_ptr<DistanceProtocol> make_distance_protocol(const RangefinderConfig& c) {
  using Device = RangefinderConfig::Device;
  // Units of the makers' settings.
  const auto unit = [&c](double makers) { return c.unit_m > 0 ? c.unit_m : makers; };
  switch (c.device) {
    case Device::kSickDl100:
      return std::make_unique<SickProtocol>(SickProtocol::Model::kDl100, unit(1e-4), c.polled);
    case Device::kSickDl50:
      return std::make_unique<SickProtocol>(SickProtocol::Model::kDl50, unit(0), c.polled);
    case Device::kSickDt1000:
      return std::make_unique<SickProtocol>(SickProtocol::Model::kDt1000, unit(1e-3), c.polled);
    case Device::kDimetix:
      return std::make_unique<DimetixProtocol>(unit(1e-4), c.polled);
    case Device::kBenewake:
      return std::make_unique<BenewakeProtocol>(unit(1e-2));
    case Device::kLeuzeBps:
      return std::make_unique<LeuzeProtocol>(unit(1e-3));
    case Device::kText:
      return std::make_unique<TextLineProtocol>(unit(0), with_escapes(c.question));
    case Device::kTelegram: {
      PlcTelegramConfig telegram = c.telegram;
      telegram.unit_m = unit(0);
      telegram.datagrams = c.port.starts_with("udp://");
      return std::make_unique<PlcTelegram>(telegram);
    }
    case Device::kWcs:
      return std::make_unique<WcsProtocol>(unit(0));
    case Device::kModbus:
      break;
  }
  return nullptr;
}

}  // namespace crane
