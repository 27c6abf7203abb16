#pragma once

namespace hybmss {

/// How a kernel computes a spring's factor 1 - l/|d|.
enum class Accuracy {
    fast, ///< from the instruction set's reciprocal square root estimate, refined; the last bits differ between makes
          ///< of CPU
    exact ///< from correctly rounded square root and division: the same bits on every CPU with the instruction set
};

} // namespace hybmss
