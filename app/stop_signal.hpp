#pragma once

/// \file
/// SIGTERM, SIGINT and SIGHUP as a wish to stop, which a run meets at its next check.

namespace hybmss {

/// From now on the first SIGTERM, SIGINT or SIGHUP only sets stop_signal(); a second one of the same ends the program.
void catch_stop_signals();

/// The signal that came, or 0.
int stop_signal();

} // namespace hybmss
