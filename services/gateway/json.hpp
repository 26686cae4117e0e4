// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "crane/client/map.hpp"
#include "dds/topics.hpp"

namespace crane::gateway {

// What the API says, by openapi.json. Metres, seconds; times as milliseconds since the Unix epoch;
// 64-bit numbers as text; what is not known is null.

using Json = nlohmann::json;

/// One line; bytes that are no UTF-8 are replaced.
std::string text_of(const Json& json);

Json to_json(const client::Status& status, TimeNs now);
/// With what it rests on: no number without validity.
Json to_json(const client::Height& height, TimeNs now);
Json to_json(const client::Clearance& clearance);
Json to_json(const client::Zone& zone);
Json to_json(const v1::ServiceStatus& status, TimeNs now);
Json to_json(const v1::HoistState& hoist, TimeNs now);

const char* surface_name(client::Surface surface);

/// The body of a question for clearance. Error: BadData naming the key: not JSON, unknown or
/// missing keys, wrong types, numbers that are not finite, more than 256 poses.
Result<client::ClearanceQuery> parse_clearance(std::string_view body);

}  // namespace crane::gateway
