// SPDX-License-Identifier: Apache-2.0
#include "mapper/zone_book.hpp"

#include <filesystem>

#include "base/read_file.hpp"
#include "base/write_file.hpp"
#include "bounds.h"
#include "service/zone_sample.hpp"

namespace crane {
namespace {

constexpr std::size_t kMaxClients = 256;

ZoneConfig to_config(const v1::Zone& z) {
  ZoneConfig c;
  c.id = static_cast<int>(z.id());
  c.name = z.name().c_str();
  c.slow_down = z.kind() == v1::ZONE_SLOW_DOWN;
  c.active = z.active() == 1;
  c.switchable = true;
  c.z_min_m = z.z_min_m();
  c.z_max_m = z.z_max_m();
  for (const v1::ZoneCorner& corner : z.corners())
    c.corners.push_back({corner.x_m(), corner.y_m()});
  return c;
}

Error refused(std::uint32_t id, const std::string& why) {
  return {ErrorCode::kConfiguration, "zone_command for zone " + std::to_string(id), why, ""};
}

}  // namespace

Result<ZoneBook> ZoneBook::open(const std::vector<ZoneConfig>& fixed, const std::string& folder) {
  ZoneBook book;
  for (const ZoneConfig& c : fixed) {
    book.zones_[static_cast<std::uint32_t>(c.id)] = to_sample(c);
    book.configured_.insert(static_cast<std::uint32_t>(c.id));
  }
  if (!fixed.empty()) book.revision_ = 1;
  if (folder.empty()) return book;
  book.file_ = folder + "/zones.yaml";
  const auto there = is_there(book.file_);
  if (!there) return there.error();
  if (!*there) return book;
  auto kept = read_site_config(book.file_);
  if (!kept)
    return Error{ErrorCode::kBadData, book.file_, "is damaged: " + kept.error().text(),
                 "remove it; zones set by topic are then to be set again"};
  for (const ZoneConfig& c : kept->zones) {
    const auto id = static_cast<std::uint32_t>(c.id);
    if (!book.configured_.contains(id))
      book.zones_[id] = to_sample(c);
    else if (book.zones_[id].switchable() == 1)
      book.zones_[id].active(c.active ? 1 : 0);
  }
  book.keep_within_bound();
  // Zones have no revision on disk: a start counts as a change.
  book.revision_ = book.zones_.empty() ? 0 : 1;
  return book;
}

Result<void> ZoneBook::apply(const v1::ZoneCommand& command) {
  const auto done = done_.find(command.client());
  if (done != done_.end() && command.sequence_number() <= done->second) return {};
  if (done == done_.end() && done_.size() >= kMaxClients) done_.erase(done_.begin());
  done_[command.client()] = command.sequence_number();
  const v1::Zone& zone = command.zone();
  const auto old = zones_.find(zone.id());
  const bool configured = configured_.contains(zone.id());
  switch (command.action()) {
    case v1::ZONE_SET:
      if (configured) return refused(zone.id(), "it is one of the mapper's configuration");
      if (old == zones_.end() && zones_.size() >= v1::MAX_ZONES)
        return refused(zone.id(), "there are 64 zones already");
      zones_[zone.id()] = zone;
      zones_[zone.id()].switchable(1);
      break;
    case v1::ZONE_REMOVE:
      if (configured) return refused(zone.id(), "it is one of the mapper's configuration");
      if (old == zones_.end()) return refused(zone.id(), "there is no such zone");
      zones_.erase(old);
      break;
    default:
      if (old == zones_.end()) return refused(zone.id(), "there is no such zone");
      if (old->second.switchable() != 1) return refused(zone.id(), "it is fixed");
      old->second.active(zone.active());
  }
  ++revision_;
  changed_ = SystemClock().now();
  return save();
}

Result<void> ZoneBook::reload(const std::vector<ZoneConfig>& fixed) {
  const std::map<std::uint32_t, v1::Zone> old = zones_;
  for (const std::uint32_t id : configured_) zones_.erase(id);
  configured_.clear();
  for (const ZoneConfig& c : fixed) {
    const auto id = static_cast<std::uint32_t>(c.id);
    v1::Zone& zone = zones_[id] = to_sample(c);
    configured_.insert(id);
    const auto before = old.find(id);
    if (before != old.end() && before->second.switchable() == 1 && zone.switchable() == 1)
      zone.active(before->second.active());
  }
  keep_within_bound();
  ++revision_;
  changed_ = SystemClock().now();
  return save();
}

void ZoneBook::follow(const v1::ZoneSet& set) {
  std::erase_if(zones_, [this](const auto& z) { return !configured_.contains(z.first); });
  for (const v1::Zone& zone : set.zones()) {
    const auto own = zones_.find(zone.id());
    if (own == zones_.end())
      zones_[zone.id()] = zone;
    else if (own->second.switchable() == 1 && zone.switchable() == 1)
      own->second.active(zone.active());
  }
  keep_within_bound();
  revision_ = set.revision() + 1;
  changed_ = SystemClock().now();
}

/// More than its bound would make the set invalid: every reader would be left without a zone. Those
/// of the configuration are kept before those set by topic.
void ZoneBook::keep_within_bound() {
  for (auto zone = zones_.end(); zones_.size() > v1::MAX_ZONES && zone != zones_.begin();) {
    --zone;
    if (configured_.contains(zone->first)) continue;
    zone = zones_.erase(zone);
    ++given_up_;
  }
  while (zones_.size() > v1::MAX_ZONES) {  // more configured ones than any file may have
    configured_.erase(std::prev(zones_.end())->first);
    zones_.erase(std::prev(zones_.end()));
    ++given_up_;
  }
}

v1::ZoneSet ZoneBook::set(std::uint32_t crane, std::uint64_t map_id) const {
  v1::ZoneSet s;
  s.crane(crane);
  s.map_id(map_id);
  s.revision(revision_);
  s.time_ns(changed_);
  for (const auto& [id, zone] : zones_) s.zones().push_back(zone);
  return s;
}

Result<void> ZoneBook::save() const {
  if (file_.empty()) return {};
  SiteConfig kept;
  for (const auto& [id, zone] : zones_)
    if (!configured_.contains(id) || zone.switchable() == 1) kept.zones.push_back(to_config(zone));
  const std::string text = to_yaml(kept);
  std::error_code ignored;  // a folder that cannot be made fails to be written in
  std::filesystem::create_directories(std::filesystem::path(file_).parent_path(), ignored);
  return write_file(file_, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

}  // namespace crane
