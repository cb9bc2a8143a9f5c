# Windows on x86-64, by Debian's MinGW-w64 with standard threads and with the libraries that scripts/platforms compiles;
# one .exe that needs no DLL of ours.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
set(CMAKE_CXX_FLAGS_INIT "-include ${CMAKE_CURRENT_LIST_DIR}/utf8_names.h")
include(${CMAKE_CURRENT_LIST_DIR}/cross.cmake)
list(APPEND CMAKE_FIND_ROOT_PATH ${FILIGREE_PLATFORMS}/windows/system)
