# Linux on 64-bit ARM, by Debian's cross compiler and with Debian's ARM packages, which scripts/platforms unpacks.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
include(${CMAKE_CURRENT_LIST_DIR}/cross.cmake)
set(system ${FILIGREE_PLATFORMS}/arm64/system)
list(APPEND CMAKE_FIND_ROOT_PATH ${system})
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,-rpath-link,${system}/usr/lib/aarch64-linux-gnu,-rpath-link,${system}/lib/aarch64-linux-gnu")
set(CMAKE_SHARED_LINKER_FLAGS_INIT ${CMAKE_EXE_LINKER_FLAGS_INIT})
set(CMAKE_MODULE_LINKER_FLAGS_INIT ${CMAKE_EXE_LINKER_FLAGS_INIT})
set(QT_HOST_PATH /usr) # whose programs write Qt's sources
file(GLOB tools /usr/lib/*-linux-gnu/cmake/Qt6CoreTools)
cmake_path(GET tools PARENT_PATH QT_HOST_PATH_CMAKE_DIR)
set(PYTHON_MODULE_EXTENSION .so) # the name that every Python takes
file(GLOB Python3_INCLUDE_DIR ${system}/usr/include/python3.*)
