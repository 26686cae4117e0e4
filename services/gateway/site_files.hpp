// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "base/result.hpp"
#include "http/message.hpp"

namespace crane::gateway {

/// The built page, all of it in memory: a path that is not a key of it is nothing, so no request
/// ever becomes a path of this host. Keys: "/", "/assets/x.js". Error: Resource when a file cannot
/// be read or there is more than 64 MiB; NotAvailable when there is no such folder.
Result<std::map<std::string, http::Response>> read_site_files(const std::string& folder);

}  // namespace crane::gateway
