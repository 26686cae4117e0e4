// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace crane::http {

/// Whether a Host line names this machine. A web page of somebody else can make a browser beside us
/// ask us, under the page's own name (DNS rebinding): that name is none of ours. True for
/// localhost, any loopback address, `local_address`, which the request came in at, and `names`;
/// with any port.
bool is_own_host(std::string_view host, std::string_view local_address,
                 const std::vector<std::string>& names);

/// Whether an Origin line, "http://host:port", is of the page that `host` itself served: a browser
/// says who made it ask.
bool is_same_origin(std::string_view origin, std::string_view host);

/// What this machine calls itself.
std::string host_name();

}  // namespace crane::http
