// SPDX-License-Identifier: Apache-2.0
#include "map_codec/compression.hpp"

#include <zstd.h>

#include <string>

namespace crane {

Bytes compress(std::span<const std::uint8_t> bytes, int level) {
  Bytes out(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), level);
  expects(ZSTD_isError(size) == 0, "zstd compresses into a bound of its own");
  out.resize(size);
  return out;
}

Result<Bytes> decompress(std::span<const std::uint8_t> bytes, std::size_t max_bytes) {
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN)
    return Error{ErrorCode::kBadData, "payload", "is no zstd frame of known size", ""};
  if (size > max_bytes)
    return Error{ErrorCode::kBadData, "payload",
                 "claims " + std::to_string(size) + " bytes, at most " + std::to_string(max_bytes) +
                     " are allowed",
                 ""};
  Bytes out(size);
  const std::size_t got = ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(got) != 0 || got != size)
    return Error{ErrorCode::kBadData, "payload", "is damaged (zstd)", ""};
  return out;
}

}  // namespace crane
