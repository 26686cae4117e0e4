// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace CLI {
class App;
}

namespace crane {

/// Numbers on the command line, of an app and its subcommands, are decimal as in configurations:
/// CLI11 alone takes --id 010 for eight, and 0x10 or nan for numbers. Call it once all options are
/// there.
void take_decimal_numbers(CLI::App& app);

}  // namespace crane
