// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/site_config.hpp"
#include "dds/topics.hpp"

namespace crane {

/// The zones of a crane: those of its configuration and those that came by topic. Only what the
/// configuration calls switchable, or what came by topic, can be changed by topic. What came by
/// topic is kept in a file, when there is a folder for it. One thread.
class ZoneBook {
 public:
  /// `folder`: where zones.yaml is kept; empty = nowhere. Error: BadData when that is damaged.
  static Result<ZoneBook> open(const std::vector<ZoneConfig>& fixed, const std::string& folder);

  /// Takes the zones of the configuration that was read again. What is switchable keeps how it was
  /// switched; what came by topic and has the number of a zone that is now configured ends.
  Result<void> reload(const std::vector<ZoneConfig>& fixed);
  /// Takes what the mapper that serves has: how zones are switched, and those set by topic. The
  /// configuration's own stay as they are here.
  void follow(const v1::ZoneSet& set);
  /// Does what a valid command says. Error: Configuration, what is against it; Resource, the file.
  /// A command that was done before is done: nothing happens.
  Result<void> apply(const v1::ZoneCommand& command);
  /// Grows with every change; 0 = there never was a zone.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// How many zones were given up because there were more than a set can hold.
  [[nodiscard]] std::uint64_t given_up() const { return given_up_; }
  [[nodiscard]] v1::ZoneSet set(std::uint32_t crane, std::uint64_t map_id) const;

 private:
  ZoneBook() = default;
  Result<void> save() const;
  void keep_within_bound();

  std::string file_;
  std::map<std::uint32_t, v1::Zone> zones_;
  std::set<std::uint32_t> configured_;           ///< ids of the zones of the configuration
  std::map<std::uint64_t, std::uint64_t> done_;  ///< last sequence number by client
  std::uint64_t revision_ = 0, given_up_ = 0;
  TimeNs changed_ = 0;
};

}  // namespace crane
