# This machine by clang with LLVM's standard library, which macOS has; unpacked beside, as Debian's package would replace
# the version that Blender needs.
set(CMAKE_C_COMPILER clang-16)
set(CMAKE_CXX_COMPILER clang++-16)
set(libcxx ${FILIGREE_PLATFORMS}/libcxx/system/usr/lib/llvm-16)
set(CMAKE_CXX_FLAGS_INIT "-stdlib=libc++ -nostdinc++ -isystem ${libcxx}/include/c++/v1")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-L${libcxx}/lib")
set(CMAKE_CXX_STANDARD_LIBRARIES "-nostdlib++ -Wl,-Bstatic -lc++ -lc++abi -lunwind -Wl,-Bdynamic")
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES FILIGREE_PLATFORMS)
include(${CMAKE_CURRENT_LIST_DIR}/cross.cmake)
