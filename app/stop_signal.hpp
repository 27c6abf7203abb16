#pragma once

/// \file
/// SIGTERM and SIGINT as a wish to stop, which a run meets at its next check.

namespace hybmss {

/// From now on the first SIGTERM or SIGINT only sets stop_signal(); a second one of the same ends the program.
void catch_stop_signals();

/// The signal that came, or 0.
int stop_signal();

} // namespace hybmss
