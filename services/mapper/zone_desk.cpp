// SPDX-License-Identifier: Apache-2.0
#include "mapper/zone_desk.hpp"

#include "base/log.hpp"

namespace crane {

Result<ZoneDesk> ZoneDesk::create(ServiceContext& context, ZoneBook& book,
                                  const MapPublisher::Identity& identity) {
  auto sets = dds::Writer<dds::ZoneSetTopic>::create(context.participant, dds::ZoneSetTopic::kName,
                                                     identity.term);
  if (!sets) return sets.error();
  return ZoneDesk(context, book, identity.map_id, std::move(*sets));
}

Result<void> ZoneDesk::say() {
  return sets_.write(book_->set(context_->participant->settings().crane, map_id_));
}

Result<void> ZoneDesk::work(MapperInputs& inputs, DropCounts& counts) {
  while (const auto command = inputs.take_command()) {
    const std::uint64_t before = book_->revision();
    if (auto done = book_->apply(**command); !done) {
      log_warning(done.error().text());
      counts.add(Cause::kZoneCommandRefused);
    }
    if (book_->revision() == before) continue;
    if (auto sent = say(); !sent) return sent;
  }
  return context_->reload() ? reload() : Result<void>{};
}

/// SIGHUP: the zones of the configuration as they are now. A bad file changes nothing.
Result<void> ZoneDesk::reload() {
  if (context_->config_file.empty()) {
    log_warning("SIGHUP: nothing to read again, there is no --config");
    return {};
  }
  auto read = read_site_config(context_->config_file);
  if (!read) {
    log_error("SIGHUP: the zones stay as they are: " + read.error().text());
    return {};
  }
  SiteConfig rest = *read;
  rest.zones = context_->config.zones;
  std::string changed;
  for (const std::string& key : changed_keys(rest, context_->config))
    changed += (changed.empty() ? "" : ", ") + key;
  if (!changed.empty())
    log_warning("SIGHUP: only zones are taken; what else changed needs a restart: " + changed);
  context_->config.zones = read->zones;
  if (auto done = book_->reload(read->zones); !done) log_warning(done.error().text());
  log_info("zones read again: " + std::to_string(read->zones.size()) + " in " +
           context_->config_file);
  return say();
}

}  // namespace crane
