// SPDX-License-Identifier: Apache-2.0
#include "config/http_config.hpp"

#include "config/key.hpp"

namespace crane {

void keys(KeyVisitor& v, HttpConfig& c) {
  v.text({"address", "address of this host where services answer /metrics, /healthz and /readyz"},
         c.address);
  v.integer({"port",
             "plus the service's number: 1 camera, 2 rangefinder, 3 stereo, 4 mapper, 5 clearance, "
             "6 ros2-mirror, 8 discovery, 9 gateway; 0: nowhere"},
            c.port, {0, 65'500});
  v.texts({"hosts",
           "names of this host by which it is asked, beside localhost, its addresses and its own "
           "name; others are refused"},
          c.hosts);
}

}  // namespace crane
