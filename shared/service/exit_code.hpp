// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.hpp"

namespace crane {

enum ExitCode { kExitOk = 0, kExitConfiguration = 2, kExitResource = 3, kExitDataLost = 4 };

inline int exit_code(const Error& error) {
  switch (error.code) {
    case ErrorCode::kConfiguration:
    case ErrorCode::kBadData:
    case ErrorCode::kWrongSize:
      return kExitConfiguration;
    case ErrorCode::kResource:
    case ErrorCode::kNotAvailable:
      return kExitResource;
  }
  return kExitResource;
}

}  // namespace crane
