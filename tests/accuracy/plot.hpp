// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "document.hpp"

namespace crane::accuracy {

/// A line plot as SVG, labels on the x axis, logarithmic y axis.
std::string to_svg(const Plot& plot);

}  // namespace crane::accuracy
