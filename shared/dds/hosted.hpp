// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dds/participant_impl.hpp"

namespace crane::dds {

/// Deletes what we made within a host, and nothing else; nothing when that is gone already.
void leave_host(Participant::Impl& impl, bool ended);

}  // namespace crane::dds
