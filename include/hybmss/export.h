#pragma once

/* What the shared library lets out. Everything else in it is hidden. */
#if defined(__GNUC__)
#define HYBMSS_EXPORT __attribute__((visibility("default")))
#define HYBMSS_LOCAL __attribute__((visibility("hidden")))
#else
#define HYBMSS_EXPORT
#define HYBMSS_LOCAL
#endif
