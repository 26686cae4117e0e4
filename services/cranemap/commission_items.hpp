// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "commission_answers.hpp"
#include "commission_book.hpp"
#include "config/site_config.hpp"

namespace crane {

/// What each item works on.
struct CommissionSite {
  std::string folder;  ///< site.yaml, calibration; what is written goes to commission/ below
  Answers* answers = nullptr;

  [[nodiscard]] std::string work() const { return folder + "/commission"; }
  [[nodiscard]] std::string site_yaml() const { return folder + "/site.yaml"; }
};

// Each looks at one thing and says in `item` what it found. Error: it could not be looked at:
// Configuration for a wrong answer, NotAvailable when it is broken off, Resource.
Result<void> commission_sensors(const CommissionSite& site, CommissionItem& item);
Result<void> commission_images(const CommissionSite& site, CommissionItem& item);
Result<void> commission_calibration(const CommissionSite& site, CommissionItem& item);
Result<void> commission_drive(const CommissionSite& site, CommissionItem& item);
Result<void> commission_map(const CommissionSite& site, CommissionItem& item);
Result<void> commission_hoist(const CommissionSite& site, CommissionItem& item);
Result<void> commission_zones(const CommissionSite& site, CommissionItem& item);

/// Writes commission/report.html. Error: Resource.
Result<void> write_commission_report(const CommissionBook& book, const std::string& folder,
                                     int crane);

}  // namespace crane
