# This machine by clang with GCC's standard library.
set(CMAKE_C_COMPILER clang-16)
set(CMAKE_CXX_COMPILER clang++-16)
include(${CMAKE_CURRENT_LIST_DIR}/cross.cmake)
