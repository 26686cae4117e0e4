// SPDX-License-Identifier: Apache-2.0
#include "http/base64.hpp"

#include <openssl/evp.h>

#include "base/expects.hpp"

namespace crane::http {

void add_base64(std::string& out, std::string_view bytes) {
  expects(bytes.size() <= (1U << 30U), "OpenSSL counts in int");
  const std::size_t at = out.size();
  out.resize(at + 4 * ((bytes.size() + 2) / 3) + 1);  // and a zero
  const int length = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(out.data() + at),
                                     reinterpret_cast<const unsigned char*>(bytes.data()),
                                     static_cast<int>(bytes.size()));
  out.resize(at + static_cast<std::size_t>(length));
}

}  // namespace crane::http
