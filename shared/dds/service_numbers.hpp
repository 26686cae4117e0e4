// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "bounds.h"

namespace crane::dds {

/// ServiceStatus.service of what came after the constants of bounds.idl.
inline constexpr std::uint32_t kServiceGateway = v1::SERVICE_DISCOVERY + 1;
inline constexpr std::uint32_t kLastService = kServiceGateway;

}  // namespace crane::dds
