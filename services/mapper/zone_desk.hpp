// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/drop_counts.hpp"
#include "dds/endpoints.hpp"
#include "mapper/map_publisher.hpp"
#include "mapper/mapper_inputs.hpp"
#include "mapper/zone_book.hpp"
#include "service/run_service.hpp"

namespace crane {

/// Serves the zones of a book: does what commands and SIGHUP say, and publishes the set when it
/// changed. One thread.
class ZoneDesk {
 public:
  static Result<ZoneDesk> create(ServiceContext& context, ZoneBook& book,
                                 const MapPublisher::Identity& identity);
  /// Publishes the set as it is. Error: what DDS says.
  Result<void> say();
  /// Commands that came, then the configuration where it is to be read again. Error: what DDS says.
  Result<void> work(MapperInputs& inputs, DropCounts& counts);

 private:
  ZoneDesk(ServiceContext& context, ZoneBook& book, std::uint64_t map_id,
           dds::Writer<dds::ZoneSetTopic> sets)
      : context_(&context), book_(&book), map_id_(map_id), sets_(std::move(sets)) {}
  Result<void> reload();

  ServiceContext* context_;
  ZoneBook* book_;
  std::uint64_t map_id_;
  dds::Writer<dds::ZoneSetTopic> sets_;
};

}  // namespace crane
