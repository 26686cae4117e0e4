// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sensors/camera/genicam_io.hpp"

/// What libcranemap-genicam.so is loaded for: cameras by Aravis. The caller owns it.
extern "C" crane::GenicamIo* cranemap_genicam_io();
