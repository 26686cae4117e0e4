// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.hpp"
#include "calibration/find_board.hpp"

namespace crane {

/// Collects images of the board from a running camera: each pair is looked at, kept or refused with
/// the reason, and the person is told what the next view should show. Pairs are written as
/// leftNN.png and rightNN.png into `folder`. Ends when nothing is missing and `enough` are kept, or
/// when it is stopped. Error: Configuration, NotAvailable, as the camera says; Resource.
Result<void> collect_live_views(const std::string& config, const Board& board,
                                const BoardFinder& finder, const std::string& folder, int enough);

}  // namespace crane
