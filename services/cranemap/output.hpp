// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

// SIGPIPE is ignored, as a service must not end when a connection does; so what is printed has to
// be looked after.

/// Sends out what was printed. False: it cannot be written, or nobody reads it any more (`| head`);
/// a command that goes on printing ends then.
bool flush_output();

/// The exit code of a command that ended with `code`: 3, with an error in the log, when its output
/// could not be written. That a reader left early is its own choice and no error.
int exit_code_of_output(int code);

}  // namespace crane
