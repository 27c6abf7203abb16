#pragma once

#include <thread>
#if defined(__x86_64__) || defined(__i386__)
#include <immintrin.h>
#endif

namespace hybmss {

/// Tells the core that this thread only waits.
inline void pause_core() {
#if defined(__x86_64__) || defined(__i386__)
    _mm_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}

/// One turn after the other of a wait for another thread: pauses at first, since what is waited for is nearly always a
/// fraction of a microsecond away; then lets other threads run, since the one waited for may be without a core.
class SpinWait {
public:
    /// `pauses`: turns before the thread lets others run.
    explicit SpinWait(int pauses) : pauses_(pauses) {}
    void turn() {
        if (pauses_ > 0) {
            --pauses_;
            pause_core();
        } else {
            std::this_thread::yield();
        }
    }

private:
    int pauses_;
};

} // namespace hybmss
