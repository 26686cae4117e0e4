// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace crane::test {

/// A network of this process and its children, in which only a loopback with these addresses
/// exists. Before any thread is made. False: this machine does not allow it.
bool own_network(const std::vector<std::string>& addresses);

}  // namespace crane::test
