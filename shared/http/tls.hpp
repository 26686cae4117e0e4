// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace crane::http {

/// What a server proves itself with, as PEM files.
struct TlsFiles {
  std::string certificate;  ///< its own first, then those that lead to a known CA
  std::string key;          ///< of the first; nobody but its owner may read it
  std::string client_ca;    ///< empty: anybody may connect; else who has a certificate of it
};

}  // namespace crane::http
