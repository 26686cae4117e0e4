// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "evaluation/evaluation.hpp"

namespace crane {

/// Where a map is right and where not, from above, y up: found green, unknown grey, low orange,
/// cleared red, hollow dark red, phantom magenta, bare floor dark; a ring around what is cleared
/// and around the first wrong CLEAR. Error: Resource.
Result<void> draw_judgement(const std::string& png_path, const TrueSolids& truth,
                            const Evaluation& evaluation, const std::string& title);

}  // namespace crane
