# Toolchain of scripts/check-neon: Debian's cross compiler, the libraries that the script unpacked, and qemu to run what
# was built.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)

# CMake's own trial compilations read this file too.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES HYBMSS_ARM64_LIBRARIES)
set(CMAKE_FIND_ROOT_PATH ${HYBMSS_ARM64_LIBRARIES})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

# The C and C++ libraries are those of the cross compiler.
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64;-L;/usr/aarch64-linux-gnu;-E;LD_LIBRARY_PATH=${HYBMSS_ARM64_LIBRARIES}/usr/lib/aarch64-linux-gnu)
