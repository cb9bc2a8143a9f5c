# WASM with the system calls of WASI, by clang with LLVM's standard library; without threads. What Debian's
# standard library for it lacks, scripts/platforms compiles into wasm/system. A size in a file that 32 bits cannot count is
# cut off: this build is there to compare bytes.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
set(CMAKE_C_COMPILER clang-16)
set(CMAKE_CXX_COMPILER clang++-16)
set(CMAKE_AR llvm-ar-16)
set(CMAKE_RANLIB llvm-ranlib-16)
set(CMAKE_HAVE_PTHREAD_H TRUE) # for FindThreads, which finds that nothing has to be linked
set(CMAKE_HAVE_LIBC_PTHREAD TRUE)
set(here ${CMAKE_CURRENT_LIST_DIR}/wasm)
set(CMAKE_C_FLAGS_INIT "--target=wasm32-wasi --sysroot=/usr -msimd128 -isystem /usr/include/wasm32-wasi")
set(CMAKE_CXX_FLAGS_INIT "--target=wasm32-wasi --sysroot=/usr -msimd128 -fwasm-exceptions -D_WASI_EMULATED_SIGNAL -D_WASI_EMULATED_PROCESS_CLOCKS -D_WASI_EMULATED_GETPID -Wno-shorten-64-to-32 -Wno-c++11-narrowing -include ${here}/system.h -nostdinc++ -isystem ${here}/include -isystem /usr/lib/llvm-16/include/wasm32-wasi/c++/v1 -isystem /usr/include/wasm32-wasi")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-L/usr/lib/llvm-16/lib/wasm32-wasi -L/usr/lib/wasm32-wasi -Wl,-z,stack-size=8388608")
file(GLOB system ${FILIGREE_PLATFORMS}/wasm/system/*.o)
list(JOIN system " " system)
set(CMAKE_CXX_STANDARD_LIBRARIES "${system} -lwasi-emulated-signal -lwasi-emulated-process-clocks -lwasi-emulated-getpid -lc-printscan-long-double")
include(${CMAKE_CURRENT_LIST_DIR}/cross.cmake)
