// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace crane {

/// One telegram of a rangefinder, understood.
struct DeviceSaid {
  enum class Kind {
    kDistance,    ///< a measurement
    kNoDistance,  ///< it measured, and has none: no target, too weak, out of its range
    kFault,       ///< it is broken; its distances are not used until it says otherwise
    kWarning,     ///< it still measures: dirt, temperature, an ageing laser
    kWell,        ///< neither fault nor warning any more
    kFigure,      ///< of its health: `text` names it, `value` is it
  };
  Kind kind = Kind::kDistance;
  double value = 0;         ///< kDistance: [m]; kFigure: in the unit that its name says
  std::string text = {};    ///< why; for people
  std::size_t bytes = 0;    ///< of the telegram on the line: so long it took to arrive
  std::size_t channel = 0;  ///< which position of a source that says several
};
using DeviceTalk = std::vector<DeviceSaid>;

}  // namespace crane
