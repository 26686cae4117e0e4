// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// What another command of ours said.
struct ChildOutput {
  int code = 0;                    ///< exit code; 128 + signal
  std::vector<std::string> lines;  ///< what it printed, without its errors
  std::string error, advice;       ///< the last error of its log, and what it says to do
};

/// Runs 'cranemap ARGUMENTS' to its end, or until this program is stopped. All that it says is kept
/// in `log`. `shown`: is printed here as well, as it comes. Error: Resource; NotAvailable, stopped.
Result<ChildOutput> run_cranemap(std::vector<std::string> arguments, const std::string& log,
                                 bool shown);

/// What was stopped by whoever sits before it; told apart from what failed.
Error broken_off();
bool is_broken_off(const Error& error);

/// The program that runs.
std::string own_program();

}  // namespace crane
