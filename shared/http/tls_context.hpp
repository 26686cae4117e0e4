// SPDX-License-Identifier: Apache-2.0
#pragma once

// Inside of the server: Boost is seen here.

#include <boost/asio/ssl/context.hpp>
#include <memory>

#include "base/result.hpp"
#include "http/tls.hpp"

namespace crane::http {

/// TLS 1.2 and 1.3, without renegotiation and without resumption: a client shows its certificate
/// each time. Error: Configuration naming the file: cannot be read, is none, does not fit the
/// other, has expired, or a key that others may read.
Result<std::unique_ptr<boost::asio::ssl::context>> make_tls_context(const TlsFiles& files);

}  // namespace crane::http
