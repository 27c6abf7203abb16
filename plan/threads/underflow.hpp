#pragma once

#include <cstdint>
#if defined(__x86_64__) || defined(__i386__)
#include <immintrin.h>
#endif

namespace hybmss {

/// What becomes of results, and of what is read, below the smallest normal number: on some processors each takes as
/// long as a hundred others, and a body that comes to rest is full of them.
enum class Underflow { gradual, to_zero };

/// Sets the calling thread's mode while it lives; flags that were raised stay.
class UnderflowMode {
public:
    explicit UnderflowMode(Underflow underflow) : before_(control() & kBits) {
        set(underflow == Underflow::to_zero ? kBits : 0);
    }
    ~UnderflowMode() { set(before_); }
    UnderflowMode(const UnderflowMode&) = delete;
    UnderflowMode& operator=(const UnderflowMode&) = delete;

private:
#if defined(__x86_64__) || defined(__i386__)
    using Control = unsigned;
    static constexpr Control kBits = 0x8040; // flush to zero, denormals are zero
    static Control control() {
        return _mm_getcsr();
    }
    static void set_control(Control control) {
        _mm_setcsr(control);
    }
#elif defined(__aarch64__)
    using Control = std::uint64_t;
    static constexpr Control kBits = 1 << 24; // both
    static Control control() {
        Control control;
        asm volatile("mrs %0, fpcr" : "=r"(control));
        return control;
    }
    static void set_control(Control control) {
        asm volatile("msr fpcr, %0" : : "r"(control));
    }
#else
    using Control = unsigned;
    static constexpr Control kBits = 0;
    static Control control() {
        return 0;
    }
    static void set_control(Control) {}
#endif
    static void set(Control bits) {
        const Control now = control();
        if ((now & kBits) != bits) { // to write it drains the pipeline
            set_control((now & ~kBits) | bits);
        }
    }

    Control before_;
};

} // namespace hybmss
