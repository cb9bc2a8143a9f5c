# Port of the C++ library without the renderer, as an overlay in a clone:
#     vcpkg install filigree --overlay-ports=packaging/vcpkg
# Not published, and not built here: vcpkg is not to be had on the machine that it was written on.
get_filename_component(SOURCE_PATH "${CURRENT_PORT_DIR}/../.." ABSOLUTE)

vcpkg_check_features(OUT_FEATURE_OPTIONS features FEATURES scene FILIGREE_SCENE)
vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS ${features} -DFILIGREE_RENDER=OFF -DFILIGREE_PROGRAMS=OFF -DFILIGREE_STUDIO=OFF -DFILIGREE_TESTS=OFF
          -DFILIGREE_BENCH=OFF -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=32
          -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/filigree)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
